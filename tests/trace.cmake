cranny_test(trace LAYERS trace)
cranny_test(gather LAYERS trace)
