// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace velatura::compositor::exports {

/// The files of compositor/exports/web, which the build puts into a source file (embed.cmake).
std::string_view web_html();
std::string_view web_css();
/// All scripts, in the order of the page.
std::string_view web_javascript();

}  // namespace velatura::compositor::exports
