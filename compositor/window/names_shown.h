// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace velatura::compositor::window {

/// A name whose middle is replaced by `…` until `fits` accepts it: both ends stay, since long names
/// often differ in their last characters. Never cuts a UTF-8 character.
std::string shorten_middle(const std::string& name,
                           const std::function<bool(const std::string&)>& fits);

/// True if the name holds every word of the search, in any case of ASCII letters. An empty search
/// finds every name.
bool is_found(std::string_view name, std::string_view search);

}  // namespace velatura::compositor::window
