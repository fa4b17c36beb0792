cranny_test(frame LAYERS frame)
cranny_test(raytrace LAYERS frame TIMEOUT 300)
cranny_test(colors LAYERS frame)
