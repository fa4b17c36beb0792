# Fits of parameters to the truth.
cranny_test(tune LAYERS compare screen TIMEOUT 120)
cranny_test(tune_command LAYERS compare LIBRARIES PkgConfig::JANSSON TIMEOUT 300)
target_compile_definitions(test_tune_command PRIVATE
    COMMAND="$<TARGET_FILE:cranny-command>" SOURCE_FOLDER="${PROJECT_SOURCE_DIR}")
add_dependencies(test_tune_command cranny-command)
