# cmake --install: the command, the libraries, headers, the CMake package and the pkg-config files;
# with --component screen what a renderer needs, alone.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/cranny")
set(screen_headers base compare filter gbuffer image screen tune)
install(TARGETS cranny EXPORT cranny-shared
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS cranny-static EXPORT cranny-static
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS cranny-frames EXPORT cranny-screen-shared
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT screen)
install(TARGETS cranny-frames-static EXPORT cranny-screen-static
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT screen)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/cranny"
    DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h")
foreach(header ${screen_headers})
    install(FILES "${PROJECT_SOURCE_DIR}/include/cranny/${header}.h"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/cranny" COMPONENT screen)
endforeach()
install(TARGETS cranny-command RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT screen)

# Who links a static library needs what it was built with.
set(screen_requires "jansson libpng libjpeg")
set(screen_libraries "-lgomp -lm")
if(CRANNY_HAVE_EXR)
    string(PREPEND screen_libraries "-lOpenEXRCore ")
endif()
set(static_requires "${screen_requires} assimp")
set(static_libraries "-lembree${CRANNY_EMBREE_MAJOR} ${screen_libraries}")
if(CRANNY_HAVE_DRACO)
    string(APPEND static_requires " draco")
    string(APPEND static_libraries " -lstdc++")
endif()
if(CRANNY_HAVE_MESHOPT)
    string(PREPEND static_libraries "-lmeshoptimizer ")
endif()
string(REPLACE " " ";" static_libraries_list "${static_libraries}")
string(REPLACE " " ";" screen_libraries_list "${screen_libraries}")

foreach(set cranny-shared cranny-static)
    install(EXPORT ${set} NAMESPACE cranny:: DESTINATION "${package_folder}")
endforeach()
foreach(set cranny-screen-shared cranny-screen-static)
    install(EXPORT ${set} NAMESPACE cranny:: DESTINATION "${package_folder}" COMPONENT screen)
endforeach()
configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/cranny-config.cmake.in" "${PROJECT_BINARY_DIR}/cranny-config.cmake"
    INSTALL_DESTINATION "${package_folder}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/cranny-config-version.cmake"
    COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/cranny-config.cmake"
    "${PROJECT_BINARY_DIR}/cranny-config-version.cmake" DESTINATION "${package_folder}" COMPONENT screen)

if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
    set(pc_libdir "${CMAKE_INSTALL_LIBDIR}")
else()
    set(pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
endif()
if(IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
    set(pc_includedir "${CMAKE_INSTALL_INCLUDEDIR}")
else()
    set(pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
# The prefix follows the file, so that an installation can be moved.
file(RELATIVE_PATH pc_up "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" pc_up "${pc_up}")
function(cranny_pkgconfig name description requires libraries)
    configure_file("${PROJECT_SOURCE_DIR}/cmake/cranny.pc.in" "${PROJECT_BINARY_DIR}/${name}.pc" @ONLY)
    install(FILES "${PROJECT_BINARY_DIR}/${name}.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" ${ARGN})
endfunction()
cranny_pkgconfig(cranny "${PROJECT_DESCRIPTION}" "${static_requires}" "${static_libraries}")
cranny_pkgconfig(cranny-screen "Ambient occlusion from a G-buffer" "${screen_requires}"
    "${screen_libraries}" COMPONENT screen)
