// SPDX-License-Identifier: Apache-2.0
#include "base/asset_bytes.h"

#include "base/asset_roots.h"
#include "base/input_guard.h"
#include "base/package_path.h"
#include "base/process/mapping_guard.h"
#include "base/zip_archive.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <system_error>
#include <vector>

namespace velatura {

namespace {

namespace fs = std::filesystem;

class OwnedBytes final : public AssetBytes {
  public:
    explicit OwnedBytes(std::string bytes) : bytes_(std::move(bytes)) {}

    std::string_view bytes() const override { return bytes_; }

  private:
    std::string bytes_;
};

class MappedBytes final : public AssetBytes {
  public:
    MappedBytes(void* start, size_t size, const std::string& file)
        : start_(start), size_(size), watched_(std::in_place, start, size, file) {}

    MappedBytes(const MappedBytes&) = delete;
    MappedBytes& operator=(const MappedBytes&) = delete;

    ~MappedBytes() override {
        watched_.reset();
        ::munmap(start_, size_);
    }

    std::string_view bytes() const override { return {static_cast<const char*>(start_), size_}; }

    void forget() const override { ::madvise(start_, size_, MADV_DONTNEED); }

  private:
    void* start_;
    size_t size_;
    std::optional<GuardedMapping> watched_;
};

class PartOfBytes final : public AssetBytes {
  public:
    PartOfBytes(AssetBytesPtr owner, std::string_view part)
        : owner_(std::move(owner)), part_(part) {}

    std::string_view bytes() const override { return part_; }

    void forget() const override { owner_->forget(); }

  private:
    AssetBytesPtr owner_;
    std::string_view part_;
};

Result<AssetBytesPtr> map_file(const std::string& file) {
    const Result<FileDescriptor> fd = asset_roots().open(file);
    if (!fd) return fd.error();

    struct stat status {};

    if (::fstat(fd->get(), &status) != 0) return file_unreadable(file, errno);
    guard_input(file);
    if (status.st_size == 0) return make_asset_bytes({});

    const auto size = static_cast<size_t>(status.st_size);
    void* start = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd->get(), 0);
    if (start == MAP_FAILED) return file_unreadable(file, errno);
    return AssetBytesPtr(std::make_shared<MappedBytes>(start, size, file));
}

bool is_file(const std::string& file) {
    struct stat status {};

    return ::stat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

/// Tells whether a file is still the one that was mapped.
struct FileIdentity {
    dev_t device = 0;
    ino_t number = 0;
    off_t size = 0;
    timespec changed{};

    static FileIdentity of(const std::string& file) {
        struct stat s {};

        if (::stat(file.c_str(), &s) != 0) return {};
        return {s.st_dev, s.st_ino, s.st_size, s.st_mtim};
    }

    bool operator==(const FileIdentity& o) const {
        return device == o.device && number == o.number && size == o.size &&
               changed.tv_sec == o.changed.tv_sec && changed.tv_nsec == o.changed.tv_nsec;
    }
};

using ArchivePtr = std::shared_ptr<const ZipArchive>;

/// The packages used last: the textures of one package come one by one, and a directory may be
/// long.
class PackageCache {
  public:
    ArchivePtr find(const std::string& name, const FileIdentity& identity) {
        const std::lock_guard lock(mutex_);
        for (auto it = entries_.begin(); it != entries_.end(); ++it) {
            if (it->name != name || !(it->identity == identity)) continue;
            entries_.splice(entries_.begin(), entries_, it);
            return it->archive;
        }
        return nullptr;
    }

    void keep(const std::string& name, const FileIdentity& identity, ArchivePtr archive) {
        const std::lock_guard lock(mutex_);
        entries_.remove_if([&](const Entry& e) { return e.name == name; });
        entries_.push_front({name, identity, std::move(archive)});
        if (entries_.size() > capacity) entries_.pop_back();
    }

  private:
    static constexpr size_t capacity = 8;

    struct Entry {
        std::string name;
        FileIdentity identity;
        ArchivePtr archive;
    };

    std::mutex mutex_;
    std::list<Entry> entries_;
};

PackageCache& package_cache() {
    static PackageCache cache;
    return cache;
}

Error no_such_file(const std::string& name) {
    return {"file-not-found", fmt::format("file \"{}\" does not exist", name)};
}

/// The member that the last of the parts names.
Result<const ZipMember*> find_member(const ZipArchive& archive,
                                     std::span<const std::string> parts) {
    const fs::path path = fs::path(parts.back()).lexically_normal();
    if (path.is_absolute() || (!path.empty() && *path.begin() == "..")) {
        return Error{"asset-leaves-package",
                     fmt::format("\"{}\" leaves the package \"{}\", expected one of its files",
                                 parts.back(), join_package_path(parts.first(parts.size() - 1)))};
    }
    const ZipMember* member = archive.find(parts.back());
    if (!member) return no_such_file(join_package_path(parts));
    return member;
}

Result<AssetBytesPtr> read_member(const ZipArchive& archive, std::span<const std::string> parts) {
    const Result<const ZipMember*> member = find_member(archive, parts);
    if (!member) return member.error();
    return archive.read(**member);
}

/// The package whose name has these parts, opened from the outermost inwards.
Result<ArchivePtr> open_archive(std::span<const std::string> parts) {
    if (parts.size() > max_package_depth) {
        return Error{"package-depth",
                     fmt::format("found a name of more than {0} packages within packages in "
                                 "\"{1}\", expected at most {0}",
                                 max_package_depth, parts.front())};
    }
    if (const Result<std::string> admitted = asset_roots().admit(parts.front()); !admitted)
        return admitted.error();
    const FileIdentity identity = FileIdentity::of(parts.front());
    ArchivePtr archive;
    for (size_t depth = 1; depth <= parts.size(); ++depth) {
        const std::string name = join_package_path(parts.first(depth));
        if (ArchivePtr known = package_cache().find(name, identity)) {
            archive = std::move(known);
            continue;
        }
        const Result<AssetBytesPtr> bytes =
            depth == 1 ? map_file(name) : read_member(*archive, parts.first(depth));
        if (!bytes) return bytes.error();
        Result<ArchivePtr> opened = ZipArchive::open(*bytes, name);
        if (!opened) return opened.error();
        archive = *opened;
        package_cache().keep(name, identity, archive);
    }
    return archive;
}

/// The parts of a name of a package's member, and no parts of any other name.
std::vector<std::string> parts_in_package(const std::string& name) {
    std::vector<std::string> parts = split_package_path(name);
    // A file may have brackets in its own name
    if (parts.size() == 1 || is_file(name)) return {};
    return parts;
}

}  // namespace

AssetBytesPtr make_asset_view(AssetBytesPtr owner, std::string_view part) {
    return std::make_shared<PartOfBytes>(std::move(owner), part);
}

AssetBytesPtr make_asset_bytes(std::string bytes) {
    return std::make_shared<OwnedBytes>(std::move(bytes));
}

Result<AssetBytesPtr> open_asset_bytes(const std::string& name) {
    const std::vector<std::string> parts = parts_in_package(name);
    if (parts.empty()) return map_file(name);
    const Result<ArchivePtr> archive = open_archive(std::span(parts).first(parts.size() - 1));
    if (!archive) return archive.error();
    return read_member(**archive, parts);
}

Result<std::string> admit_asset(const std::string& name) {
    std::vector<std::string> parts = parts_in_package(name);
    if (parts.empty()) return asset_roots().admit(name);
    const Result<ArchivePtr> archive = open_archive(std::span(parts).first(parts.size() - 1));
    if (!archive) return archive.error();
    const Result<const ZipMember*> member = find_member(**archive, parts);
    if (!member) return member.error();
    Result<std::string> package = asset_roots().admit(parts.front());
    if (!package) return package.error();
    parts.front() = *std::move(package);
    return join_package_path(parts);
}

bool asset_exists(const std::string& name) {
    const std::vector<std::string> parts = parts_in_package(name);
    if (parts.empty()) return is_file(name);
    const Result<ArchivePtr> archive = open_archive(std::span(parts).first(parts.size() - 1));
    return archive && (*archive)->find(parts.back()) != nullptr;
}

}  // namespace velatura
