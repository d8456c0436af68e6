# SPDX-License-Identifier: Apache-2.0
# A fast linker for the test programs where there is one: linking is half of what an edit of one body waits for. The programs
# that users run keep the default linker: linked by mold or lld they take 5 MB more memory at the start.
include(CheckLinkerFlag)
set(velatura_fast_linker)
foreach(linker mold lld)
  check_linker_flag(CXX -fuse-ld=${linker} VELATURA_HAS_${linker})
  if(VELATURA_HAS_${linker})
    set(velatura_fast_linker -fuse-ld=${linker})
    break()
  endif()
endforeach()
