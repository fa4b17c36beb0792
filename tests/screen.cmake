cranny_test(lanes LAYERS screen)
cranny_test(screen LAYERS screen TIMEOUT 120)
