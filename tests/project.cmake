# Tests of the project as a whole: the fuzzer's seeds, failing allocations, and what the Khronos
# validator and a browser say of baked files.

# The fuzzer's source without its engine, with whatever compiler and sanitizers the build has.
add_executable(fuzz_gltf_replay ${PROJECT_SOURCE_DIR}/fuzz/gltf/gltf.c)
target_link_libraries(fuzz_gltf_replay PRIVATE cranny-flags cranny-scene)
add_test(NAME fuzz_replay COMMAND fuzz_gltf_replay ${PROJECT_SOURCE_DIR}/fuzz/gltf/seeds)
set_tests_properties(fuzz_replay PROPERTIES TIMEOUT 60)

# Allocations of the library's own objects are routed to the test, which refuses them one by one.
set(seeds ${PROJECT_SOURCE_DIR}/fuzz/gltf/seeds)
add_executable(test_alloc alloc/alloc.c alloc/frames.c)
target_include_directories(test_alloc PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_link_libraries(test_alloc PRIVATE cranny-flags cranny-bake cranny-compare cranny-screen)
foreach(function malloc calloc realloc aligned_alloc strdup free)
    target_link_options(test_alloc PRIVATE LINKER:--wrap=${function})
endforeach()
add_test(NAME alloc COMMAND test_alloc ${seeds}/indexed.glb ${seeds}/masked.glb ${seeds}/modes.gltf
    ${seeds}/sparse.gltf ${seeds}/skin_morph.gltf ${seeds}/instancing.gltf
    ${seeds}/meshopt.gltf ${seeds}/draco.gltf)
set_tests_properties(alloc PROPERTIES TIMEOUT 120 SKIP_RETURN_CODE 77)

# tests/web: needs node and `npm ci` in that folder, else the tests say why they were skipped.
find_program(CRANNY_NODE node)
if(CRANNY_NODE AND TARGET cranny-command)
    set(lacking "")
    if(NOT CRANNY_HAVE_MESHOPT)
        string(APPEND lacking " EXT_meshopt_compression KHR_meshopt_compression")
    endif()
    if(NOT CRANNY_HAVE_DRACO)
        string(APPEND lacking " KHR_draco_mesh_compression")
    endif()
    set(web_environment "CRANNY_LACKING=${lacking}" ${CRANNY_TEST_ENVIRONMENT} "CRANNY_COMMAND=$<TARGET_FILE:cranny-command>"
        "CRANNY_WEB_OUTPUT=${CMAKE_CURRENT_BINARY_DIR}/web")
    foreach(test bake validate lossless browser compare)
        add_test(NAME web_${test} COMMAND ${CRANNY_NODE} ${CMAKE_CURRENT_SOURCE_DIR}/web/${test}.mjs)
        set_tests_properties(web_${test} PROPERTIES LABELS web SKIP_RETURN_CODE 77 TIMEOUT 900
            ENVIRONMENT "${web_environment}")
    endforeach()
    set_tests_properties(web_bake PROPERTIES FIXTURES_SETUP baked PROCESSORS 2)
    set_tests_properties(web_validate web_lossless PROPERTIES FIXTURES_REQUIRED baked)
elseif(NOT CRANNY_NODE)
    message(STATUS "node not found: the web tests are left out")
endif()
