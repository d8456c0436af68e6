// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace velatura::usd::crate {

// Files and memory have the same order of bytes
static_assert(std::endian::native == std::endian::little);

/// What is wrong with a file, and at which byte.
struct Problem {
    uint64_t at = 0;
    std::string message;  ///< "found …, expected …"
};

/// Reads little-endian data at a place that is checked against the bytes. After the first failure
/// every read gives zeros, so that only the end of a longer read needs a check. The first failure
/// is kept.
class Cursor {
  public:
    explicit Cursor(std::string_view bytes, uint64_t at = 0) : bytes_(bytes), at_(at) {
        if (at > bytes.size()) fail_at(at, "an offset beyond the end", "one inside");
    }

    bool ok() const { return ok_; }

    uint64_t at() const { return at_; }

    /// Bytes from here to the end; 0 after a failure.
    uint64_t left() const { return ok_ ? bytes_.size() - at_ : 0; }

    const Problem& problem() const { return problem_; }

    /// Keeps the first failure; always false.
    bool fail(std::string_view found, std::string_view expected) {
        return fail_at(at_, found, expected);
    }

    bool fail_at(uint64_t at, std::string_view found, std::string_view expected) {
        if (ok_) {
            problem_.at = at;
            problem_.message.append("found ").append(found);
            problem_.message.append(", expected ").append(expected);
        }
        ok_ = false;
        return false;
    }

    bool fail(Problem problem) {
        if (ok_) problem_ = std::move(problem);
        ok_ = false;
        return false;
    }

    bool seek(uint64_t at) {
        if (!ok_) return false;
        if (at > bytes_.size()) return fail_at(at_, "an offset beyond the end", "one inside");
        at_ = at;
        return true;
    }

    /// The next `size` bytes; empty after a failure.
    std::string_view take(uint64_t size) {
        if (!ok_ || size > left()) {
            fail("the end of the data", "more of it");
            return {};
        }
        const std::string_view result = bytes_.substr(at_, size);
        at_ += size;
        return result;
    }

    template <class T>
    T read() {
        static_assert(std::is_trivially_copyable_v<T>);
        T value{};
        const std::string_view raw = take(sizeof(T));
        if (!raw.empty()) std::memcpy(&value, raw.data(), sizeof(T));
        return value;
    }

    /// Follows an offset that is stored here and counts from here.
    bool follow() {
        const uint64_t start = at_;
        const auto offset = read<int64_t>();
        if (!ok_) return false;
        const uint64_t target = start + uint64_t(offset);
        if (target > bytes_.size()) {
            return fail_at(start, "a relative offset out of the data", "one inside");
        }
        at_ = target;
        return true;
    }

    /// A count of items of at least `item_size` bytes each, which must be there.
    uint64_t count(uint64_t item_size) {
        const uint64_t start = at_;
        const auto n = read<uint64_t>();
        if (n <= left() / item_size) return n;
        fail_at(start, "a count of " + std::to_string(n) + " items", "no more than there are");
        return 0;
    }

  private:
    std::string_view bytes_;
    uint64_t at_ = 0;
    bool ok_ = true;
    Problem problem_;
};

}  // namespace velatura::usd::crate
