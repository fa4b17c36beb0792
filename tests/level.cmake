# The demo level, its page, and the previews of baked values.
cranny_test(preview LAYERS bake)
cranny_test(level LAYERS bake LIBRARIES PkgConfig::JANSSON)
add_dependencies(test_level cranny-level cranny-demo)
target_compile_definitions(test_level PRIVATE
    LEVEL_PROGRAM="$<TARGET_FILE:cranny-level>" DEMO_PROGRAM="$<TARGET_FILE:cranny-demo>")
set_tests_properties(level PROPERTIES TIMEOUT 300)
