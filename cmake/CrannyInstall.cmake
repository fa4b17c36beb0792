# cmake --install: the command, both libraries, headers, the CMake package and cranny.pc.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/cranny")
install(TARGETS cranny EXPORT cranny-shared
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS cranny-static EXPORT cranny-static
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/cranny"
    DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h")
install(TARGETS cranny-command RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")

# Who links the static library needs what it was built with.
set(static_requires "jansson libpng libjpeg assimp")
set(static_libraries "-lembree${CRANNY_EMBREE_MAJOR} -lgomp -lm")
if(CRANNY_HAVE_DRACO)
    string(APPEND static_requires " draco")
    string(APPEND static_libraries " -lstdc++")
endif()
if(CRANNY_HAVE_MESHOPT)
    string(PREPEND static_libraries "-lmeshoptimizer ")
endif()
if(CRANNY_HAVE_EXR)
    string(PREPEND static_libraries "-lOpenEXRCore ")
endif()
string(REPLACE " " ";" static_libraries_list "${static_libraries}")

install(EXPORT cranny-shared NAMESPACE cranny:: DESTINATION "${package_folder}")
install(EXPORT cranny-static NAMESPACE cranny:: DESTINATION "${package_folder}")
configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/cranny-config.cmake.in" "${PROJECT_BINARY_DIR}/cranny-config.cmake"
    INSTALL_DESTINATION "${package_folder}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/cranny-config-version.cmake"
    COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/cranny-config.cmake"
    "${PROJECT_BINARY_DIR}/cranny-config-version.cmake" DESTINATION "${package_folder}")

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
configure_file("${PROJECT_SOURCE_DIR}/cmake/cranny.pc.in" "${PROJECT_BINARY_DIR}/cranny.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/cranny.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
