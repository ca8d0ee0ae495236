# `cmake --install`: the library, its headers, the package that find_package(widestereo) finds, the licence and the
# command.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Of a shared library: versions that write_basic_package_version_file() takes for each other's.
set_target_properties(widestereo PROPERTIES VERSION ${PROJECT_VERSION}
                                            SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/widestereo)
install(TARGETS widestereo EXPORT widestereoTargets INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY include/widestereo TYPE INCLUDE)
install(FILES LICENSE TYPE DOC)
install(EXPORT widestereoTargets NAMESPACE widestereo:: DESTINATION ${package_folder})
get_target_property(widestereo_type widestereo TYPE)
configure_package_config_file(cmake/widestereoConfig.cmake.in widestereoConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(widestereoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/widestereoConfig.cmake ${PROJECT_BINARY_DIR}/widestereoConfigVersion.cmake
        DESTINATION ${package_folder})
if(WIDESTEREO_BUILD_TOOLS)
  install(TARGETS widestereo_command)
endif()
