# cranny compare: results, files, the cache, and what an interruption leaves.
cranny_test(compare_command LAYERS compare LIBRARIES PkgConfig::JANSSON TIMEOUT 300)
target_compile_definitions(test_compare_command PRIVATE
    COMMAND="$<TARGET_FILE:cranny-command>" SOURCE_FOLDER="${PROJECT_SOURCE_DIR}")
add_dependencies(test_compare_command cranny-command)
