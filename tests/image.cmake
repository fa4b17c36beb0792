# Float images: every format there and back, and what hostile files do.
cranny_test(image LAYERS base TIMEOUT 120)

add_executable(fuzz_image_replay ${PROJECT_SOURCE_DIR}/fuzz/image/image.c)
target_link_libraries(fuzz_image_replay PRIVATE cranny-flags cranny-base)
add_test(NAME fuzz_image_replay COMMAND fuzz_image_replay ${PROJECT_SOURCE_DIR}/fuzz/image/seeds)
set_tests_properties(fuzz_image_replay PROPERTIES TIMEOUT 60)

if(CRANNY_HAVE_EXR)
    cranny_test(exr LAYERS base TIMEOUT 120)
endif()
