cranny_test(filter LAYERS screen TIMEOUT 120)
