cranny_test(gltf LAYERS scene)
cranny_test(variants LAYERS scene)
