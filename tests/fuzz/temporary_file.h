// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace velatura::fuzz {

/// A folder of this process in memory (/dev/shm) that ends with it.
const std::string& memory_folder();

/// Writes the bytes to a file of that folder, over what it held; its path.
std::string memory_file(const std::string& name, std::string_view bytes);

}  // namespace velatura::fuzz
