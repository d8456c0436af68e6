# SPDX-License-Identifier: Apache-2.0
# Run by the build: writes OUTPUT, a C++ file that tells one renderer from another by its sources and its COMPILER.
# Two builds with one id give the same pixels; of two ids nothing is known, and so a render goes on under its own only.
string(SHA256 text "${COMPILER}")
file(STRINGS ${LIST} files)
foreach(file ${files})
  file(SHA256 ${file} hash)
  string(APPEND text ${hash})
endforeach()
string(SHA256 id "${text}")
string(SUBSTRING ${id} 0 16 id)
file(WRITE ${OUTPUT} "// SPDX-License-Identifier: Apache-2.0\n#include \"app/build_id.h\"\n\nnamespace velatura::app {\n\nstd::string_view build_id() { return \"${id}\"; }\n\n}  // namespace velatura::app\n")
