# The command, the example and what cmake --install gives.
cranny_test(cli LIBRARIES PkgConfig::JANSSON TIMEOUT 300)
target_compile_definitions(test_cli PRIVATE
    COMMAND="$<TARGET_FILE:cranny-command>" SOURCE_FOLDER="${PROJECT_SOURCE_DIR}")
target_include_directories(test_cli PRIVATE ${PROJECT_SOURCE_DIR}/include)
add_dependencies(test_cli cranny-command)

add_executable(example_bake ${PROJECT_SOURCE_DIR}/examples/bake.c)
target_link_libraries(example_bake PRIVATE cranny-flags cranny)
add_test(NAME example_bake COMMAND example_bake
    ${PROJECT_SOURCE_DIR}/examples/corner.gltf ${CMAKE_CURRENT_BINARY_DIR}/corner-ao.gltf)

# A sanitized library needs its runtime in every program; the plain build shows the same.
if(NOT CRANNY_SANITIZE)
    foreach(step prefix headers symbols package pkgconfig screen)
        add_test(NAME install_${step} COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/install/install.sh ${step}
            ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR} ${CMAKE_INSTALL_LIBDIR}
            ${CMAKE_C_COMPILER} "${CMAKE_CXX_COMPILER}" ${CMAKE_COMMAND})
        set_tests_properties(install_${step} PROPERTIES LABELS install TIMEOUT 120)
    endforeach()
    set_tests_properties(install_prefix PROPERTIES FIXTURES_SETUP installed)
    set_tests_properties(install_headers install_symbols install_package install_pkgconfig install_screen
        PROPERTIES FIXTURES_REQUIRED installed)
endif()
