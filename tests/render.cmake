# cranny render and check --depth, and the example that renders a depth image.
foreach(test render render_depth)
    cranny_test(${test} LAYERS screen LIBRARIES PkgConfig::JANSSON TIMEOUT 300)
    target_compile_definitions(test_${test} PRIVATE
        COMMAND="$<TARGET_FILE:cranny-command>" SOURCE_FOLDER="${PROJECT_SOURCE_DIR}")
    add_dependencies(test_${test} cranny-command)
endforeach()

add_executable(example_depth_to_ao ${PROJECT_SOURCE_DIR}/examples/depth_to_ao.c)
target_link_libraries(example_depth_to_ao PRIVATE cranny-flags cranny)
add_test(NAME example_depth COMMAND cranny-command render ${PROJECT_SOURCE_DIR}/examples/corner.gltf
    --size 160x120 --guard 0 --fov 45 --gbuffer ${CMAKE_CURRENT_BINARY_DIR}/corner
    -o ${CMAKE_CURRENT_BINARY_DIR}/corner-ao.png)
set(depth_ending pfm)
if(CRANNY_HAVE_EXR)
    set(depth_ending exr)
endif()
add_test(NAME example_depth_to_ao COMMAND example_depth_to_ao
    ${CMAKE_CURRENT_BINARY_DIR}/corner-depth.${depth_ending} 45
    ${CMAKE_CURRENT_BINARY_DIR}/corner-depth-ao.png)
set_tests_properties(example_depth PROPERTIES FIXTURES_SETUP corner_depth)
set_tests_properties(example_depth_to_ao PROPERTIES FIXTURES_REQUIRED corner_depth)
