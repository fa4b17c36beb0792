cranny_test(volumes LAYERS volumes TIMEOUT 120)
cranny_test(volumes_frame LAYERS volumes frame compare TIMEOUT 300)
cranny_test(volumes_views LAYERS volumes frame compare TIMEOUT 120)
