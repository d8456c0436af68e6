// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <functional>
#include <string>
#include <string_view>

namespace velatura {

/// Writes a file so that a reader sees the old content or the new one, never a part: `write` fills
/// a temporary file in the same folder (its path is the argument), which is then flushed to disk
/// and renamed over `path`. On any failure the temporary is removed and the old file stays; after
/// the rename only the folder can fail to be flushed, and then the new file stands there whole.
/// Folders of `path` that are missing are made. Messages name `path`, not the temporary. Errors:
/// "io-write", "io-flush" (that), "overwrites-input" (base/input_guard.h).
Result<void> write_atomically(
    const std::string& path,
    const std::function<Result<void>(const std::string& temporary)>& write);

/// Makes the folders of a file that is to be written, as far as they are missing. Errors:
/// "io-write".
Result<void> make_folder_of(const std::string& path);

/// Removes temporary files that write_atomically of this path left when its process was killed.
/// Those that somebody is writing are locked (flock) and stay.
void sweep_temporaries(const std::string& path);

/// The same as write_atomically for text or bytes at hand.
Result<void> write_file_atomically(const std::string& path, std::string_view content);

/// Reads a whole regular file. Errors: "io-open" (missing, not a regular file, too large),
/// "io-read".
Result<std::string> read_file(const std::string& path, size_t size_limit_bytes = size_t(1) << 32);

}  // namespace velatura
