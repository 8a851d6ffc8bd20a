# Read by cpack when packages are made: refuses those of a build for one machine, unless they are for a trial on it.
if(CPACK_GRAPNEL_NATIVE)
  if(NOT CPACK_GRAPNEL_TRIAL)
    message(FATAL_ERROR "This build is tuned to the machine that made it (GRAPNEL_NATIVE is ON) and makes no packages that travel. "
                        "`scripts/packages` builds some; -D CPACK_GRAPNEL_TRIAL=ON makes packages for trials on this machine.")
  endif()
  set(CPACK_PACKAGE_VERSION "${CPACK_PACKAGE_VERSION}+native")
endif()
