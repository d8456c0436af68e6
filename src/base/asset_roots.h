// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"
#include "base/result.h"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace velatura {

/// Refuses names that never mean a file of this machine, wherever a scene may read: URLs, network
/// shares ("//server/x", "\\server\x"), names with a zero byte or longer than the system takes.
/// Error: "asset-name".
Result<void> check_asset_name(std::string_view name);

/// "cannot read FILE: why"; error: an errno.
Error file_unreadable(const std::string& file, int error);

/// Where the files may lie that a scene names: anywhere, or beneath some folders alone. This is the
/// one door to them: whatever reads an asset opens it here, or asks here under which name a library
/// may open it. Copies share the folders. Thread-safe.
///
/// Only regular files are opened, and looking at others has no side effect: a pipe is not waited
/// for, a device not touched. Limit: a hard link beneath a folder is a file of that folder.
class AssetRoots {
  public:
    /// Anywhere.
    AssetRoots() = default;

    /// Beneath these folders, after all symbolic links are followed. A folder that is not there
    /// holds nothing.
    static AssetRoots beneath(const std::vector<std::string>& folders);

    bool is_confined() const { return folders_ != nullptr; }

    /// Opens for reading. When confined, what was checked is what is opened, even if somebody
    /// changes links meanwhile: the way from the folder to the file is gone without following any.
    /// Errors: "asset-name", "file-not-found", "file-unreadable" (no regular file, no permission),
    /// "asset-outside-roots".
    Result<FileDescriptor> open(const std::string& file) const;

    /// For libraries that open files by name: the name to give them, when confined that without
    /// symbolic links. A file of no bytes, as everything in /proc is, is refused: reading it may
    /// wait for ever. Errors: those of open().
    Result<std::string> admit(const std::string& file) const;

  private:
    struct Folder {
        std::string path;  ///< without symbolic links
        FileDescriptor descriptor;
    };

    /// A file as seen from one of the folders.
    struct Place {
        const Folder* folder = nullptr;
        std::string real;  ///< the whole name, without symbolic links
        std::string way;   ///< from the folder
    };

    Result<Place> place_of(const std::string& file) const;

    std::shared_ptr<const std::vector<Folder>> folders_;  // null: anywhere
};

/// Those of this process, which everything that opens assets asks, so that nobody can forget to:
/// anywhere, until set_asset_roots() says otherwise.
const AssetRoots& asset_roots();

/// Before the scene is opened: not while other threads open assets.
void set_asset_roots(AssetRoots roots);

/// For libraries that open assets by name, of files or of members of packages: the name to give
/// them; see AssetRoots::admit. Errors: those of open_asset_bytes and AssetRoots::admit.
Result<std::string> admit_asset(const std::string& name);

}  // namespace velatura
