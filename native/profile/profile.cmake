# Optimisation by a profile, and across files: see ../README.md, Working on it.

set(profile ${CMAKE_CURRENT_LIST_DIR}/core.profdata)

# Compiles `target` by CISTERN_PROFILE, and links what uses it accordingly.
function(apply_profile target)
  # Functions of one file are told apart by its name without folders, so that clones elsewhere find theirs.
  set(names "SHELL:-mllvm -static-func-full-module-prefix=false")
  if(CISTERN_PROFILE STREQUAL "TRAIN")
    target_compile_options(${target} PRIVATE -fprofile-generate ${names})
    target_link_options(${target} INTERFACE -fprofile-generate)
    return()
  endif()
  if(NOT CISTERN_PROFILE STREQUAL "USE" OR NOT CMAKE_BUILD_TYPE STREQUAL "Release")
    return()
  endif()
  find_program(CISTERN_LLD ld.lld-19)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang" OR NOT CMAKE_CXX_COMPILER_VERSION MATCHES "^19\\." OR NOT CISTERN_LLD)
    message(STATUS "Without the profile of native/profile, which is for Clang 19 and its linker: about a tenth slower")
    return()
  endif()
  # What has changed since it was made is compiled as if there were none: no reason to warn.
  target_compile_options(${target} PRIVATE -flto=thin -fprofile-use=${profile} ${names}
                         -Wno-profile-instr-unprofiled -Wno-profile-instr-out-of-date -Wno-backend-plugin)
  get_target_property(sources ${target} SOURCES)
  set_property(SOURCE ${sources} APPEND PROPERTY OBJECT_DEPENDS ${profile})
  target_link_options(${target} INTERFACE -flto=thin -fuse-ld=${CISTERN_LLD})
endfunction()
