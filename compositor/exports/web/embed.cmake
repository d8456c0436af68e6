# SPDX-License-Identifier: Apache-2.0
# cmake -D OUTPUT=web_text.cpp -D FOLDER=compositor/exports/web -P embed.cmake: the files of the page as a source file.
function(embed function)
  set(content "")
  foreach(file IN LISTS ARGN)
    file(READ ${FOLDER}/${file} one)
    string(APPEND content "${one}")
  endforeach()
  set(text "${text}\nstd::string_view ${function}() {\n    return R\"velatura(${content})velatura\";\n}\n" PARENT_SCOPE)
endfunction()

set(text "// SPDX-License-Identifier: Apache-2.0\n// Made by compositor/exports/web/embed.cmake\n#include \"compositor/exports/web_text.h\"\n\nnamespace velatura::compositor::exports {\n")
embed(web_html page.html)
embed(web_css page.css)
embed(web_javascript planes.js display.js look.js draw.js view.js rows.js main.js)
file(WRITE ${OUTPUT} "${text}\n}  // namespace velatura::compositor::exports\n")
