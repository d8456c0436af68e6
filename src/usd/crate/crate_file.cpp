// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/crate_file.h"

#include "usd/crate/coding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace velatura::usd::crate {

namespace {

struct Section {
    std::string_view name;
    uint64_t start = 0;
    uint64_t size = 0;
};

/// Reads the tables of one file, each from its section.
class StructureReader {
  public:
    explicit StructureReader(CrateFile& file) : file_(file) {}

    bool read(Structure& out) {
        if (!read_header() || !read_sections()) return false;
        return section("TOKENS", [&](Cursor& c) { tokens(c); }) &&
               section("STRINGS", [&](Cursor& c) { strings(c); }) &&
               section("FIELDS", [&](Cursor& c) { fields(c, out); }) &&
               section("FIELDSETS", [&](Cursor& c) { field_sets(c, out); }) &&
               section("PATHS", [&](Cursor& c) { read_paths(file_, c, out.bad_paths); }) &&
               section("SPECS", [&](Cursor& c) { specs(c, out); });
    }

    const Problem& problem() const { return problem_; }

  private:
    bool fail(uint64_t at, std::string message) {
        problem_ = {at, std::move(message)};
        return false;
    }

    bool read_header();
    bool read_sections();
    void tokens(Cursor& c);
    void split_tokens(Cursor& c, std::string_view text, uint64_t count);
    void strings(Cursor& c);
    void fields(Cursor& c, Structure& out);
    void field_sets(Cursor& c, Structure& out);
    void specs(Cursor& c, Structure& out);
    bool plain_specs(Cursor& c, Structure& out);

    /// A count of items within the limit.
    uint64_t count(Cursor& c) {
        const uint64_t at = c.at();
        const auto n = c.read<uint64_t>();
        if (n <= file_.max_items()) return n;
        c.fail_at(at, fmt::format("{} items", n),
                  fmt::format("at most {} in a file of {} bytes", file_.max_items(),
                              file_.bytes().size()));
        return 0;
    }

    template <class Read>
    bool section(std::string_view name, const Read& read) {
        const auto it = std::find_if(sections_.begin(), sections_.end(),
                                     [&](const Section& s) { return s.name == name; });
        // What has no content needs no section
        if (it == sections_.end()) return true;
        Cursor c(file_.bytes().substr(0, it->start + it->size), it->start);
        read(c);
        if (c.ok()) return true;
        problem_ = c.problem();
        problem_.message += fmt::format(" in section {}", name);
        return false;
    }

    bool is_compressed() const { return file_.version >= Version{0, 4, 0}; }

    CrateFile& file_;
    std::vector<Section> sections_;
    Problem problem_;
};

bool StructureReader::read_header() {
    const std::string_view bytes = file_.bytes();
    if (!bytes.starts_with(crate_magic)) return fail(0, "found no crate, expected 'PXR-USDC'");
    if (bytes.size() < bootstrap_size) {
        return fail(bytes.size(), fmt::format("found {} bytes, expected the {} of a header",
                                              bytes.size(), bootstrap_size));
    }
    Cursor c(bytes, crate_magic.size());
    file_.version.major_number = c.read<uint8_t>();
    file_.version.minor_number = c.read<uint8_t>();
    file_.version.patch_number = c.read<uint8_t>();
    const Version v = file_.version;
    if (v.major_number != newest_version.major_number ||
        v.minor_number > newest_version.minor_number || v == Version{0, 0, 0} ||
        v.minor_number == 3) {
        return fail(8, fmt::format("found version {}.{}.{}, expected 0.0.1 to 0.{} without 0.3",
                                   v.major_number, v.minor_number, v.patch_number,
                                   newest_version.minor_number));
    }
    return true;
}

bool StructureReader::read_sections() {
    const std::string_view bytes = file_.bytes();
    const uint64_t place = 16;
    Cursor c(bytes, place);
    const auto start = c.read<uint64_t>();
    if (start < bootstrap_size || start >= bytes.size()) {
        return fail(place, fmt::format("found the table of contents at {}, expected it inside the "
                                       "file's {} bytes",
                                       start, bytes.size()));
    }
    c.seek(start);
    const uint64_t n = c.count(32);
    for (uint64_t i = 0; i < n && c.ok(); ++i) {
        const uint64_t at = c.at();
        Section s;
        s.name = c.take(16);
        s.name = s.name.substr(0, s.name.find('\0'));
        s.start = c.read<uint64_t>();
        s.size = c.read<uint64_t>();
        if (s.start > bytes.size() || s.size > bytes.size() - s.start) {
            return fail(at, fmt::format("found a section of {} bytes at {}, expected it inside the "
                                        "file's {} bytes",
                                        s.size, s.start, bytes.size()));
        }
        sections_.push_back(s);
    }
    problem_ = c.problem();
    return c.ok();
}

void StructureReader::tokens(Cursor& c) {
    const uint64_t n = count(c);
    const auto size = c.read<uint64_t>();
    if (!is_compressed()) return split_tokens(c, c.take(size), n);
    const auto compressed_size = c.read<uint64_t>();
    const uint64_t at = c.at();
    const std::string_view compressed = c.take(compressed_size);
    if (!c.ok()) return;
    if (size > max_decompressed(compressed_size)) {
        c.fail_at(at, fmt::format("{} bytes of {} compressed ones", size, compressed_size),
                  "at most 255 times as many");
        return;
    }
    // Tokens are unique, so a byte of LZ4 cannot bring in many of them
    if (n > 1024 + 16 * compressed_size) {
        c.fail_at(at, fmt::format("{} tokens in {} bytes", n, compressed_size), "fewer");
        return;
    }
    std::string text(size, '\0');
    size_t written = 0;
    if (size > 0 && (!decompress(compressed, text, written) || written != size)) {
        c.fail_at(at, "corrupt LZ4 data", fmt::format("{} bytes of tokens", size));
        return;
    }
    split_tokens(c, text, n);
}

void StructureReader::split_tokens(Cursor& c, std::string_view text, uint64_t n) {
    if (!c.ok()) return;
    if (n > text.size()) {
        c.fail(fmt::format("{} tokens in {} bytes", n, text.size()), "at most one per byte");
        return;
    }
    file_.tokens.reserve(n);
    for (uint64_t i = 0; i < n; ++i) {
        const size_t end = text.find('\0');
        if (end == std::string_view::npos) {
            c.fail(fmt::format("{} tokens", i), fmt::format("{}, each ended by a zero", n));
            return;
        }
        file_.tokens.emplace_back(text.substr(0, end));
        text.remove_prefix(end + 1);
    }
}

void StructureReader::strings(Cursor& c) {
    const uint64_t n = c.count(sizeof(uint32_t));
    file_.strings.reserve(n);
    for (uint64_t i = 0; i < n; ++i) {
        const uint64_t at = c.at();
        const auto token = c.read<uint32_t>();
        if (token >= file_.tokens.size()) {
            c.fail_at(at, fmt::format("token {}", token),
                      fmt::format("one of {}", file_.tokens.size()));
            return;
        }
        file_.strings.push_back(token);
    }
}

void StructureReader::fields(Cursor& c, Structure& out) {
    const uint64_t start = c.at();
    if (!is_compressed()) {
        // Four bytes of padding, token, value
        const uint64_t n = c.count(16);
        out.fields.resize(n);
        for (FieldEntry& f : out.fields) {
            c.read<uint32_t>();
            f.token = c.read<uint32_t>();
            f.value.bits = c.read<uint64_t>();
        }
    } else {
        const uint64_t n = count(c);
        std::vector<int32_t> tokens;
        if (!read_integers(c, n, tokens)) return;
        const auto size = c.read<uint64_t>();
        const uint64_t at = c.at();
        const std::string_view compressed = c.take(size);
        if (!c.ok()) return;
        if (n * sizeof(uint64_t) > max_decompressed(size)) {
            c.fail_at(at, fmt::format("{} values in {} compressed bytes", n, size), "fewer");
            return;
        }
        std::string values(n * sizeof(uint64_t), '\0');
        size_t written = 0;
        if (n > 0 && (!decompress(compressed, values, written) || written != values.size())) {
            c.fail_at(at, "corrupt LZ4 data", fmt::format("{} values of fields", n));
            return;
        }
        out.fields.resize(n);
        for (uint64_t i = 0; i < n; ++i) {
            out.fields[i].token = uint32_t(tokens[i]);
            std::memcpy(&out.fields[i].value.bits, values.data() + i * sizeof(uint64_t),
                        sizeof(uint64_t));
        }
    }
    for (const FieldEntry& f : out.fields) {
        if (f.token < file_.tokens.size()) continue;
        c.fail_at(start, fmt::format("token {} as the name of a field", f.token),
                  fmt::format("one of {}", file_.tokens.size()));
        return;
    }
}

void StructureReader::field_sets(Cursor& c, Structure& out) {
    const uint64_t start = c.at();
    if (!is_compressed()) {
        out.field_sets.resize(c.count(sizeof(uint32_t)));
        for (uint32_t& f : out.field_sets) f = c.read<uint32_t>();
    } else {
        const uint64_t n = count(c);
        std::vector<int32_t> fields;
        if (!read_integers(c, n, fields)) return;
        out.field_sets.assign(fields.begin(), fields.end());
    }
    if (!c.ok()) return;
    if (!out.field_sets.empty() && out.field_sets.back() != field_set_end) {
        c.fail_at(start, "an unterminated set of fields", "its end mark");
        return;
    }
    for (const uint32_t f : out.field_sets) {
        if (f == field_set_end || f < out.fields.size()) continue;
        c.fail_at(start, fmt::format("field {}", f), fmt::format("one of {}", out.fields.size()));
        return;
    }
}

bool StructureReader::plain_specs(Cursor& c, Structure& out) {
    // The first version pads every spec in front
    const bool is_padded = file_.version < Version{0, 1, 0};
    out.specs.resize(c.count(is_padded ? 16 : 12));
    for (SpecEntry& s : out.specs) {
        if (is_padded) c.read<uint32_t>();
        s.path = c.read<uint32_t>();
        s.field_set = c.read<uint32_t>();
        s.form = c.read<uint32_t>();
    }
    return c.ok();
}

void StructureReader::specs(Cursor& c, Structure& out) {
    const uint64_t start = c.at();
    if (!is_compressed()) {
        if (!plain_specs(c, out)) return;
    } else {
        const uint64_t n = count(c);
        std::vector<int32_t> column;
        if (!read_integers(c, n, column)) return;
        out.specs.resize(n);
        for (uint64_t i = 0; i < n; ++i) out.specs[i].path = uint32_t(column[i]);
        if (!read_integers(c, n, column)) return;
        for (uint64_t i = 0; i < n; ++i) out.specs[i].field_set = uint32_t(column[i]);
        if (!read_integers(c, n, column)) return;
        for (uint64_t i = 0; i < n; ++i) out.specs[i].form = uint32_t(column[i]);
    }
    for (size_t i = 0; i < out.specs.size(); ++i) {
        const SpecEntry& s = out.specs[i];
        if (s.path >= file_.paths.size()) {
            c.fail_at(start, fmt::format("path {} in spec {}", s.path, i),
                      fmt::format("one of {}", file_.paths.size()));
            return;
        }
        if (s.field_set >= out.field_sets.size() ||
            (s.field_set > 0 && out.field_sets[s.field_set - 1] != field_set_end)) {
            c.fail_at(start, fmt::format("fields from {} in spec {}", s.field_set, i),
                      "the beginning of a set of fields");
            return;
        }
    }
}

}  // namespace

CrateFile::CrateFile(AssetBytesPtr bytes, std::string identifier, Diagnostics& diagnostics)
    : bytes_(std::move(bytes)),
      identifier_(std::move(identifier)),
      file_id_(diagnostics.file_id(identifier_)),
      late_(diagnostics.late()) {}

bool CrateFile::reserve_memory(uint64_t size) const {
    const uint64_t limit = max_copied_bytes();
    uint64_t old = reserved_.load();
    do {
        if (size > limit || old > limit - size) return false;
    } while (!reserved_.compare_exchange_weak(old, old + size));
    return true;
}

void CrateFile::release_memory(uint64_t size) const {
    reserved_ -= size;
}

void CrateFile::remember_array(ValueRep rep,
                               const std::shared_ptr<const layer::ArrayData>& array) const {
    const std::scoped_lock lock(arrays_mutex_);
    if (arrays_.size() >= purge_at_) {
        std::erase_if(arrays_, [](const auto& entry) { return entry.second.expired(); });
        purge_at_ = std::max<size_t>(1024, 2 * arrays_.size());
    }
    arrays_[rep.bits] = array;
}

void CrateFile::report_late(const Problem& problem) const {
    Diagnostic d;
    d.code = "usd-crate-value";
    d.loc = loc();
    d.message = fmt::format("{} at byte {}", problem.message, problem.at);
    late_.add(std::move(d));
}

bool read_integers(Cursor& cursor, uint64_t count, std::vector<int32_t>& out) {
    const uint64_t at = cursor.at();
    const auto size = cursor.read<uint64_t>();
    const std::string_view compressed = cursor.take(size);
    if (!cursor.ok()) return false;
    if (count > max_decoded_integers(size)) {
        return cursor.fail_at(at, fmt::format("{} integers in {} bytes", count, size), "fewer");
    }
    out.resize(count);
    std::string scratch;
    if (decode_integers(compressed, std::span<int32_t>(out), scratch)) return true;
    return cursor.fail_at(at, "corrupt integers", fmt::format("{} of them", count));
}

std::string describe(const CrateFile& file, const Problem& problem) {
    return fmt::format("{}: {} at byte {}", file.identifier(), problem.message, problem.at);
}

Result<Structure> read_structure(CrateFile& file) {
    Structure result;
    StructureReader reader(file);
    if (reader.read(result)) return result;
    return Error{"usd-crate", describe(file, reader.problem())};
}

}  // namespace velatura::usd::crate
