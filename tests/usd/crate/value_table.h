// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/coding.h"

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace velatura::usd::crate {

/// What an earlier change left may point anywhere.
inline bool is_inside(const std::string& bytes, uint64_t at, uint64_t size) {
    return at <= bytes.size() && size <= bytes.size() - at;
}

inline void put(std::string& bytes, size_t at, const void* data, size_t size) {
    if (is_inside(bytes, at, size)) std::memcpy(bytes.data() + at, data, size);
}

inline uint64_t get(const std::string& bytes, size_t at) {
    uint64_t value = 0;
    if (is_inside(bytes, at, sizeof value)) std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

/// The values of all fields of a crate with compressed tables, 8 bytes each. Ref: AOUSD Core
/// Specification 1.0.1, 16.3.8.
class ValueTable {
  public:
    /// Nothing where the file is too broken to find them.
    static std::optional<ValueTable> of(const std::string& bytes) {
        ValueTable table;
        table.entry_ = get(bytes, 16) + 8 + 2 * 32;
        const uint64_t start = get(bytes, table.entry_ + 16);
        const uint64_t count = get(bytes, start);
        if (!is_inside(bytes, start, 16) || count == 0 || count > 100000) return std::nullopt;
        const uint64_t names = get(bytes, start + 8);
        if (!is_inside(bytes, start + 16, names)) return std::nullopt;
        const uint64_t at = start + 16 + names, size = get(bytes, at);
        if (!is_inside(bytes, at, 8) || !is_inside(bytes, at + 8, size)) return std::nullopt;
        table.names_ = bytes.substr(start, at - start);
        table.values_.resize(count * 8);
        size_t written = 0;
        if (!decompress(std::string_view(bytes).substr(at + 8, size), table.values_, written))
            return std::nullopt;
        return table;
    }

    size_t size() const { return values_.size() / 8; }

    uint64_t operator[](size_t i) const { return get(values_, i * 8); }

    void set(size_t i, uint64_t value) { put(values_, i * 8, &value, 8); }

    /// Puts the table at the end of the file it is of.
    void append_to(std::string& bytes) const {
        std::string section = names_, compressed;
        compress(values_, compressed);
        const uint64_t compressed_size = compressed.size();
        section.append(reinterpret_cast<const char*>(&compressed_size), 8).append(compressed);
        const uint64_t place = bytes.size(), size = section.size();
        bytes += section;
        put(bytes, entry_ + 16, &place, 8);
        put(bytes, entry_ + 24, &size, 8);
    }

  private:
    size_t entry_ = 0;   // of the section in the table of contents
    std::string names_;  // the section in front of the values
    std::string values_;
};

}  // namespace velatura::usd::crate
