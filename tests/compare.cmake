# The error between images, by the library and by the command.
cranny_test(compare LAYERS compare)
cranny_test(truth LAYERS report screen)
cranny_test(diff LAYERS compare LIBRARIES PkgConfig::JANSSON TIMEOUT 60)
target_compile_definitions(test_diff PRIVATE COMMAND="$<TARGET_FILE:cranny-command>")
add_dependencies(test_diff cranny-command)
