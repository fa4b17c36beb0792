cranny_test(trace LAYERS trace)
cranny_test(gather LAYERS trace)
cranny_test(fog LAYERS trace TIMEOUT 120)
