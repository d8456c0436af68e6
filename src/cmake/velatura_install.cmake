# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` and cpack put where. install_plugin() belongs to each plugin, install_velatura() comes last.
# Component runtime: what users run. Component development: the libraries and headers of find_package(velatura).
include(GNUInstallDirs)
set(VELATURA_PLUGIN_DIR lib/velatura/plugins)  # src/plugin/registry.cpp searches it, relative to the program and below the prefix
set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

# install_plugin(NAME): shared object and manifest.
function(install_plugin name)
  set(folder ${VELATURA_PLUGIN_DIR}/${name})
  install(TARGETS velatura_plugin_${name} LIBRARY DESTINATION ${folder} COMPONENT runtime)
  install(FILES plugin.txt DESTINATION ${folder} COMPONENT runtime)
endfunction()

# install_plugin_program(NAME TARGET): a program that the plugin starts, beside its shared object.
function(install_plugin_program name target)
  install(TARGETS ${target} RUNTIME DESTINATION ${VELATURA_PLUGIN_DIR}/${name} COMPONENT runtime)
endfunction()

# install_manual(PROGRAM...): man pages and shell completions, made from what the programs print for --help.
function(install_manual)
  find_package(Python3 COMPONENTS Interpreter)
  if(NOT Python3_FOUND OR CMAKE_CROSSCOMPILING)
    message(STATUS "man pages and completions are not built: they need python3, and programs that run here")
    return()
  endif()
  set(scripts ${CMAKE_SOURCE_DIR}/src/cmake/manual)
  set(share ${CMAKE_BINARY_DIR}/share)
  set(programs)
  foreach(program IN LISTS ARGN)
    list(APPEND programs $<TARGET_FILE:${program}>)
  endforeach()
  add_custom_command(OUTPUT ${share}.stamp
    COMMAND ${Python3_EXECUTABLE} -B ${scripts}/make_manual.py --version ${PROJECT_VERSION} --output ${share} ${programs}
    COMMAND ${CMAKE_COMMAND} -E touch ${share}.stamp
    DEPENDS ${ARGN} ${scripts}/make_manual.py ${scripts}/help_text.py ${scripts}/man_page.py ${scripts}/completion.py
    COMMENT "Man pages and completions" VERBATIM)
  add_custom_target(velatura_manual ALL DEPENDS ${share}.stamp)
  install(DIRECTORY ${share}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT runtime)
endfunction()

# install_libraries(TIER...): what velatura-config.cmake exports as velatura::TIER, as add_tier names it within the tree.
function(install_libraries)
  set(folder lib/cmake/velatura)
  foreach(tier warnings numerics ${ARGN})
    set_target_properties(velatura_${tier} PROPERTIES EXPORT_NAME ${tier})
  endforeach()
  # Programs that use them may have another default
  target_compile_features(velatura_numerics INTERFACE cxx_std_20)
  install(TARGETS velatura_warnings velatura_numerics EXPORT velatura COMPONENT development)
  foreach(tier IN LISTS ARGN)
    install(TARGETS velatura_${tier} EXPORT velatura
      ARCHIVE DESTINATION lib COMPONENT development
      FILE_SET HEADERS DESTINATION include/velatura COMPONENT development)
  endforeach()
  install(EXPORT velatura NAMESPACE velatura:: FILE velatura-targets.cmake DESTINATION ${folder} COMPONENT development)
  include(CMakePackageConfigHelpers)
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/velatura-config-version.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_SOURCE_DIR}/src/cmake/velatura-config.cmake ${CMAKE_BINARY_DIR}/velatura-config-version.cmake
    DESTINATION ${folder} COMPONENT development)
endfunction()

# The license, and those of the libraries that are linked, in one file where Debian has it.
function(install_copyright)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/NOTICE ${CMAKE_SOURCE_DIR}/LICENSE)
  file(READ ${CMAKE_SOURCE_DIR}/NOTICE notice)
  file(READ ${CMAKE_SOURCE_DIR}/LICENSE license)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/copyright CONTENT "@notice@\n@license@" @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/copyright DESTINATION share/doc/velatura COMPONENT runtime)
endfunction()

function(install_velatura)
  set(programs velatura velatura-comp)
  if(TARGET velatura-comp-ui)
    list(APPEND programs velatura-comp-ui velatura-view)
  endif()
  install(TARGETS ${programs} RUNTIME DESTINATION bin COMPONENT runtime)
  install_manual(velatura velatura-comp)
  install_copyright()
  set(modules io look mix denoise noise bake exports inspect)
  list(TRANSFORM modules PREPEND compositor_)
  # The renderer with all that it links; the order is that of src/CMakeLists.txt
  set(usd layer text crate package materialx compose stage)
  list(TRANSFORM usd PREPEND usd_)
  set(rooms context color motion materials lights geometry linking volumes instancing)
  list(TRANSFORM rooms PREPEND translate_)
  install_libraries(base_process base plugin canvas image accumulate statistics layers ${modules} compositor
    sampling guiding ${usd} scene geometry accel camera shading media lights film ${rooms} translate
    integrator_classic integrator render)
endfunction()
