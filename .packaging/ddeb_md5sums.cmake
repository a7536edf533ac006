# CPack runs this when the packages are made.
foreach(package IN LISTS CPACK_PACKAGE_FILES)
  if(package MATCHES "\\.ddeb$")
    execute_process(COMMAND ${CPACK_THERMBAL_PYTHON3} ${CMAKE_CURRENT_LIST_DIR}/ddeb_md5sums.py ${package} COMMAND_ERROR_IS_FATAL ANY)
  endif()
endforeach()
