// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/limits.h"
#include "base/result.h"
#include "usd/crate/crate_format.h"
#include "usd/crate/cursor.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"
#include "usd/layer/value.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura::usd::crate {

/// The bytes and the tables that values of one file refer to. Kept by every value that is brought
/// in later; only read once it is open.
class CrateFile {
  public:
    CrateFile(AssetBytesPtr bytes, std::string identifier, Diagnostics& diagnostics);

    std::string_view bytes() const { return bytes_->bytes(); }

    const std::string& identifier() const { return identifier_; }

    SourceLoc loc() const { return {file_id_, 0, 0}; }

    Version version;
    std::vector<layer::Token> tokens;
    std::vector<uint32_t> strings;   ///< token of each string
    std::vector<layer::Path> paths;  ///< empty where the file has no or no valid path

    /// Items a table may have: a small file can be the compressed form of tables that fill the
    /// memory.
    uint64_t max_items() const { return 2'000'000 + bytes().size(); }

    /// Bytes that copies out of the file may take together.
    uint64_t max_copied_bytes() const { return limits().array_bytes + 1024 * bytes().size(); }

    /// Reserves memory for an array that will be decoded; false beyond max_copied_bytes().
    bool reserve_memory(uint64_t size) const;
    void release_memory(uint64_t size) const;

    /// The array that stands for `rep` while someone has it; `make` makes it otherwise.
    template <class Make>
    std::shared_ptr<const layer::ArrayData> shared_array(ValueRep rep, const Make& make) const {
        {
            const std::scoped_lock lock(arrays_mutex_);
            const auto it = arrays_.find(rep.bits);
            if (it != arrays_.end()) {
                if (auto array = it->second.lock()) return array;
            }
        }
        std::shared_ptr<const layer::ArrayData> array = make();
        if (array) remember_array(rep, array);
        return array;
    }

    /// Reports what is wrong with a value that is brought in after opening.
    void report_late(const Problem& problem) const;

  private:
    void remember_array(ValueRep rep, const std::shared_ptr<const layer::ArrayData>& array) const;

    AssetBytesPtr bytes_;
    std::string identifier_;
    uint32_t file_id_ = 0;
    LateDiagnostics late_;
    mutable std::atomic<uint64_t> reserved_{0};
    mutable std::mutex arrays_mutex_;
    mutable std::unordered_map<uint64_t, std::weak_ptr<const layer::ArrayData>> arrays_;
    mutable size_t purge_at_ = 1024;
};

using CrateFilePtr = std::shared_ptr<const CrateFile>;

struct FieldEntry {
    uint32_t token = 0;
    ValueRep value;
};

struct SpecEntry {
    uint32_t path = 0;
    uint32_t field_set = 0;  ///< where its run begins in field_sets
    uint32_t form = 0;       ///< SpecForm
};

/// The tables that are needed only while a layer is built. All indices are in range but for specs,
/// whose paths may be empty.
struct Structure {
    std::vector<FieldEntry> fields;
    std::vector<uint32_t> field_sets;  ///< runs of fields, each ended by field_set_end
    std::vector<SpecEntry> specs;
    size_t bad_paths = 0;  ///< entries of the table of paths that are no valid paths
};

/// Reads header, table of contents and all tables. What is wrong with any of them costs the layer:
/// error "usd-crate" with the place.
Result<Structure> read_structure(CrateFile& file);

/// Reads the table of paths that begins at the cursor into file.paths; what is wrong is left in the
/// cursor. Names that no path may have leave their paths empty and are counted.
void read_paths(CrateFile& file, Cursor& cursor, size_t& bad_paths);

/// Reads `count` coded integers: size in bytes, then the bytes.
bool read_integers(Cursor& cursor, uint64_t count, std::vector<int32_t>& out);

/// "file.usdc: message at byte N".
std::string describe(const CrateFile& file, const Problem& problem);

}  // namespace velatura::usd::crate
