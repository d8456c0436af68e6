// SPDX-License-Identifier: Apache-2.0
#include "base/asset_roots.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <cctype>
#include <cerrno>
#include <climits>
#include <filesystem>
#include <system_error>
#include <utility>

namespace velatura {

namespace {

namespace fs = std::filesystem;

constexpr int reading = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;

/// The scheme of a URL: "http" of "http://x"; empty when the name is none. Files may have colons in
/// their names, so that two slashes must follow, but for schemes that go without.
std::string_view url_scheme(std::string_view name) {
    const size_t colon = name.find(':');
    if (colon == std::string_view::npos || colon < 2) return {};
    const std::string_view scheme = name.substr(0, colon);
    if (!std::isalpha(static_cast<unsigned char>(scheme[0]))) return {};
    for (const char c : scheme) {
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '+' && c != '-' && c != '.')
            return {};
    }
    const bool has_slashes = name.substr(colon + 1).starts_with("//");
    return has_slashes || scheme == "file" || scheme == "data" ? scheme : std::string_view();
}

Error not_found(const std::string& file) {
    return {"file-not-found", fmt::format("file \"{}\" does not exist", file)};
}

Error failed_to_open(const std::string& file, int error) {
    return error == ENOENT || error == ENOTDIR ? not_found(file) : file_unreadable(file, error);
}

std::string_view kind_name(mode_t mode) {
    if (S_ISDIR(mode)) return "a folder";
    if (S_ISFIFO(mode)) return "a pipe";
    if (S_ISSOCK(mode)) return "a socket";
    if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
    return "not a file";
}

Result<void> check_regular(const std::string& file, const struct stat& status) {
    if (S_ISREG(status.st_mode)) return {};
    return Error{"file-unreadable", fmt::format("\"{}\" is {}, expected a regular file", file,
                                                kind_name(status.st_mode))};
}

/// Opens an entry of a folder. Looks first: opening a device may already do something.
Result<FileDescriptor> open_entry(int folder,
                                  const std::string& entry,
                                  bool follows_links,
                                  const std::string& file) {
    struct stat status {};

    const int stat_flags = follows_links ? 0 : AT_SYMLINK_NOFOLLOW;
    if (::fstatat(folder, entry.c_str(), &status, stat_flags) != 0)
        return failed_to_open(file, errno);
    if (const Result<void> regular = check_regular(file, status); !regular) return regular.error();
    const int flags = reading | (follows_links ? 0 : O_NOFOLLOW);
    FileDescriptor fd(uninterrupted([&] { return ::openat(folder, entry.c_str(), flags); }));
    if (!fd.is_open()) return failed_to_open(file, errno);
    // And again: it may be another by now
    if (::fstat(fd.get(), &status) != 0) return file_unreadable(file, errno);
    if (const Result<void> regular = check_regular(file, status); !regular) return regular.error();
    return fd;
}

/// Goes from a folder to a file, along folders that are no links.
Result<FileDescriptor> open_beneath(int folder, std::string_view way, const std::string& file) {
    FileDescriptor at;
    for (size_t slash = way.find('/'); slash != std::string_view::npos; slash = way.find('/')) {
        const std::string step(way.substr(0, slash));
        constexpr int passing = O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
        const int from = at.is_open() ? at.get() : folder;
        FileDescriptor next(uninterrupted([&] { return ::openat(from, step.c_str(), passing); }));
        if (!next.is_open()) return failed_to_open(file, errno);
        at = std::move(next);
        way.remove_prefix(slash + 1);
    }
    return open_entry(at.is_open() ? at.get() : folder, std::string(way), false, file);
}

AssetRoots& process_roots() {
    static AssetRoots roots;
    return roots;
}

}  // namespace

Error file_unreadable(const std::string& file, int error) {
    return {"file-unreadable",
            fmt::format("cannot read \"{}\": {}", file, std::generic_category().message(error))};
}

const AssetRoots& asset_roots() {
    return process_roots();
}

void set_asset_roots(AssetRoots roots) {
    process_roots() = std::move(roots);
}

Result<void> check_asset_name(std::string_view name) {
    if (name.find('\0') != std::string_view::npos)
        return Error{"asset-name", "the name contains a zero byte"};
    if (name.size() >= PATH_MAX)
        return Error{"asset-name", fmt::format("the name has {} bytes, expected at most {}",
                                               name.size(), PATH_MAX - 1)};
    if (const std::string_view scheme = url_scheme(name); !scheme.empty())
        return Error{
            "asset-name",
            fmt::format("found a URL ({}:), expected a file; URLs are not fetched", scheme)};
    if (name.starts_with("//") || name.starts_with("\\\\"))
        return Error{"asset-name", "found the name of a network share, expected a file"};
    return {};
}

AssetRoots AssetRoots::beneath(const std::vector<std::string>& folders) {
    auto opened = std::make_shared<std::vector<Folder>>();
    for (const std::string& name : folders) {
        std::error_code failed;
        const fs::path path = fs::canonical(name, failed);
        if (failed) continue;
        FileDescriptor fd(::open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
        if (fd.is_open()) opened->push_back({path.string(), std::move(fd)});
    }
    AssetRoots roots;
    roots.folders_ = std::move(opened);
    return roots;
}

Result<AssetRoots::Place> AssetRoots::place_of(const std::string& file) const {
    std::error_code failed;
    fs::path real = fs::canonical(file, failed);
    const bool exists = !failed;
    // Whether a file is there is none of a scene's business either, outside of its folders
    if (!exists) real = fs::weakly_canonical(file, failed);
    if (failed) return file_unreadable(file, failed.value());
    for (const Folder& folder : *folders_) {
        const std::string start = folder.path == "/" ? folder.path : folder.path + '/';
        if (!real.native().starts_with(start)) continue;
        if (!exists) return not_found(file);
        return Place{&folder, real.string(), real.string().substr(start.size())};
    }
    const bool is_same = fs::path(file).lexically_normal() == real;
    return Error{"asset-outside-roots",
                 fmt::format("\"{}\" {}is not below the scene's folder or an --asset-root", file,
                             is_same ? "" : fmt::format("is \"{}\", which ", real.string()))};
}

Result<FileDescriptor> AssetRoots::open(const std::string& file) const {
    if (const Result<void> named = check_asset_name(file); !named) return named.error();
    if (!folders_) return open_entry(AT_FDCWD, file, true, file);
    const Result<Place> place = place_of(file);
    if (!place) return place.error();
    return open_beneath(place->folder->descriptor.get(), place->way, file);
}

Result<std::string> AssetRoots::admit(const std::string& file) const {
    const Result<FileDescriptor> opened = open(file);
    if (!opened) return opened.error();

    struct stat status {};

    if (::fstat(opened->get(), &status) != 0) return file_unreadable(file, errno);
    if (status.st_size == 0)
        return Error{"file-unreadable", fmt::format("\"{}\" has no bytes", file)};
    if (!folders_) return file;
    Result<Place> place = place_of(file);
    if (!place) return place.error();
    return std::move(place->real);
}

}  // namespace velatura
