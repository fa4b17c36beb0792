cranny_test(lanes LAYERS screen)
cranny_test(screen LAYERS screen TIMEOUT 120)

# The same equations as shaders.
find_program(CRANNY_GLSLANG glslangValidator)
if(CRANNY_GLSLANG)
    foreach(method ssao hbao crease alchemy raymarch)
        add_test(NAME equations_${method} COMMAND ${CRANNY_GLSLANG} --target-env vulkan1.1
            -I${PROJECT_SOURCE_DIR}/src -DMETHOD=${method}_estimate
            -o ${CMAKE_CURRENT_BINARY_DIR}/${method}.spv ${CMAKE_CURRENT_SOURCE_DIR}/equations/estimate.comp)
    endforeach()
else()
    add_test(NAME equations COMMAND sh -c "echo 'equations: SKIPPED: no glslangValidator'; exit 77")
    set_tests_properties(equations PROPERTIES SKIP_RETURN_CODE 77)
endif()
