cranny_test(trace LAYERS trace)
cranny_test(gather LAYERS trace)
cranny_test(fog LAYERS trace TIMEOUT 120)
cranny_test(sphere LAYERS trace)

# cranny/runtime.h is for games' own sources, in C++ and as a shader, too.
if(CMAKE_CXX_COMPILER)
    add_executable(test_runtime runtime/runtime.cc)
    target_include_directories(test_runtime PRIVATE ${PROJECT_SOURCE_DIR}/include)
    target_compile_options(test_runtime PRIVATE -Wall -Wextra -Wshadow -Werror)
    add_test(NAME runtime COMMAND test_runtime)
endif()
find_program(CRANNY_GLSLANG glslangValidator)
if(CRANNY_GLSLANG)
    add_test(NAME runtime_shader COMMAND ${CRANNY_GLSLANG} --target-env vulkan1.1
        -I${PROJECT_SOURCE_DIR}/include -o ${CMAKE_CURRENT_BINARY_DIR}/runtime.spv
        ${CMAKE_CURRENT_SOURCE_DIR}/runtime/runtime.comp)
endif()
