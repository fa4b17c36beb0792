cranny_test(gbuffer LAYERS screen)
cranny_test(doctor LAYERS screen)
