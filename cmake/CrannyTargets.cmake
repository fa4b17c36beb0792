# Flags shared by all of the project's targets, and the helpers that make a layer or a test.
add_library(cranny-flags INTERFACE)
target_compile_options(cranny-flags INTERFACE
    -ffp-contract=off
    $<$<COMPILE_LANGUAGE:C>:-Wall -Wextra -Wundef -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror=vla>)
if(CRANNY_WERROR)
    target_compile_options(cranny-flags INTERFACE -Werror)
endif()
if(CRANNY_SANITIZE)
    target_compile_options(cranny-flags INTERFACE -fsanitize=${CRANNY_SANITIZE} -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
    target_link_options(cranny-flags INTERFACE -fsanitize=${CRANNY_SANITIZE})
endif()
target_compile_definitions(cranny-flags INTERFACE _GNU_SOURCE=1
    CRANNY_EMBREE_MAJOR=${CRANNY_EMBREE_MAJOR}
    CRANNY_HAVE_MESHOPT=${CRANNY_HAVE_MESHOPT}
    CRANNY_HAVE_DRACO=${CRANNY_HAVE_DRACO}
    CRANNY_HAVE_EXR=${CRANNY_HAVE_EXR})

# cranny_layer(NAME SOURCES... ) : one folder of src/ as an object library plus a static one for tests.
# What a layer may include is what it links: lower layers only.
function(cranny_layer name)
    cmake_parse_arguments(L "" "" "SOURCES;LAYERS;LIBRARIES" ${ARGN})
    add_library(cranny-${name} STATIC ${L_SOURCES})
    target_include_directories(cranny-${name} PUBLIC ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(cranny-${name} PRIVATE CRANNY_BUILDING=1)
    target_link_libraries(cranny-${name} PRIVATE cranny-flags PUBLIC ${L_LIBRARIES} m)
    foreach(layer ${L_LAYERS})
        target_link_libraries(cranny-${name} PUBLIC cranny-${layer})
    endforeach()
    set_property(GLOBAL APPEND PROPERTY CRANNY_LAYERS cranny-${name})
endfunction()

# cranny_test(NAME [LAYERS base scene ...] [SOURCES extra.c ...] [LABELS ...]): tests/NAME.c against the layers' internals.
function(cranny_test name)
    cmake_parse_arguments(T "" "TIMEOUT" "LAYERS;SOURCES;LIBRARIES;LABELS" ${ARGN})
    add_executable(test_${name} ${name}.c ${T_SOURCES})
    target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
    target_link_libraries(test_${name} PRIVATE cranny-flags ${T_LIBRARIES})
    foreach(layer ${T_LAYERS})
        target_link_libraries(test_${name} PRIVATE cranny-${layer})
    endforeach()
    add_test(NAME ${name} COMMAND test_${name})
    set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 ENVIRONMENT "${CRANNY_TEST_ENVIRONMENT}")
    if(T_TIMEOUT)
        set_tests_properties(${name} PROPERTIES TIMEOUT ${T_TIMEOUT})
    endif()
    if(T_LABELS)
        set_tests_properties(${name} PROPERTIES LABELS "${T_LABELS}")
    endif()
endfunction()
