# thermbal_install_compressed(source AS name.gz DESTINATION folder COMPONENT component): without a name and a time of its own inside, as
# Debian's policy asks for and as a reproducible build needs.
find_program(GZIP gzip REQUIRED)

function(thermbal_install_compressed source)
  cmake_parse_arguments(ARG "" "AS;DESTINATION;COMPONENT" "" ${ARGN})
  set(folder ${CMAKE_BINARY_DIR}/compressed/${ARG_COMPONENT})
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${folder}/${ARG_AS}
    COMMAND ${GZIP} -9nc ${source} > ${folder}/${ARG_AS} DEPENDS ${source} VERBATIM)
  string(MAKE_C_IDENTIFIER compressed-${ARG_COMPONENT}-${ARG_AS} name)
  add_custom_target(${name} ALL DEPENDS ${folder}/${ARG_AS})
  install(FILES ${folder}/${ARG_AS} DESTINATION ${ARG_DESTINATION} COMPONENT ${ARG_COMPONENT})
endfunction()
