# `cmake --install`: the library, its headers, the package that find_package(widestereo) finds, the licence and the
# command.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/widestereo)
install(TARGETS widestereo EXPORT widestereoTargets)
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
