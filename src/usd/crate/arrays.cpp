// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/arrays.h"

#include "usd/crate/coding.h"
#include "usd/crate/stored.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace velatura::usd::crate {

namespace {

/// Elements that are the file's own bytes.
class MappedArray final : public layer::ArrayData {
  public:
    MappedArray(CrateFilePtr file, const char* data, size_t size)
        : file_(std::move(file)), data_(data), size_(size) {}

    size_t size() const override { return size_; }

    const void* data() const override { return data_; }

  private:
    CrateFilePtr file_;
    const char* data_;
    size_t size_;
};

/// Elements that are made on first use.
template <class T>
class DecodedArray final : public layer::ArrayData {
  public:
    /// `stored` is what lies behind the count of elements.
    DecodedArray(CrateFilePtr file, std::string_view stored, size_t size, bool is_compressed)
        : file_(std::move(file)), stored_(stored), size_(size), is_compressed_(is_compressed) {}

    ~DecodedArray() override { file_->release_memory(size_ * sizeof(T)); }

    size_t size() const override { return size_; }

    const void* data() const override {
        std::call_once(once_, [&] {
            elements_ = std::make_unique<T[]>(size_);
            if (is_compressed_ ? decode() : copy()) return;
            clear();
            Problem problem;
            problem.at = uint64_t(stored_.data() - file_->bytes().data());
            problem.message = fmt::format(
                "found corrupt data of an array, expected {} elements; they are zeros", size_);
            file_->report_late(problem);
        });
        return elements_.get();
    }

  private:
    void clear() const {
        if constexpr (is_text<T>) {
            std::fill_n(elements_.get(), size_, T());
        } else {
            std::memset(static_cast<void*>(elements_.get()), 0, size_ * sizeof(T));
        }
    }

    bool copy() const {
        uint64_t copied = 0;
        for (size_t i = 0; i < size_; ++i) {
            const char* const from = stored_.data() + i * stored_size<T>();
            if constexpr (is_text<T>) {
                uint32_t index = 0;
                std::memcpy(&index, from, sizeof index);
                if (!load_text(*file_, index, elements_[i], copied)) return false;
                // One long text may stand for every element
                if (copied > file_->max_copied_bytes()) return false;
            } else {
                elements_[i] = load_element<T>(from);
            }
        }
        return true;
    }

    bool decode() const {
        Cursor c(stored_);
        if constexpr (is_integer_of_arrays<T>) {
            using Signed = std::make_signed_t<T>;
            return integers(c, std::span(reinterpret_cast<Signed*>(elements_.get()), size_));
        } else if constexpr (is_float_of_arrays<T>) {
            const bool has_table = c.read<char>() == 't';
            std::string_view table;
            if (has_table) table = c.take(uint64_t(c.read<uint32_t>()) * sizeof(T));
            std::vector<int32_t> codes(size_);
            if (!integers(c, std::span<int32_t>(codes))) return false;
            for (size_t i = 0; i < size_; ++i) {
                if (!has_table) {
                    elements_[i] = number(codes[i]);
                    continue;
                }
                const auto at = uint64_t(uint32_t(codes[i])) * sizeof(T);
                if (at >= table.size()) return false;
                elements_[i] = load_element<T>(table.data() + at);
            }
            return true;
        }
        return false;
    }

    static T number(int32_t code) {
        if constexpr (std::is_same_v<T, layer::Float16>) {
            return layer::Float16(float(code));
        } else {
            return T(code);
        }
    }

    template <class Int>
    static bool integers(Cursor& c, std::span<Int> out) {
        const std::string_view compressed = c.take(c.read<uint64_t>());
        std::string scratch;
        return c.ok() && decode_integers(compressed, out, scratch);
    }

    CrateFilePtr file_;
    std::string_view stored_;
    size_t size_;
    bool is_compressed_;
    mutable std::once_flag once_;
    mutable std::unique_ptr<T[]> elements_;
};

/// Checks that the stored form of a compressed array can hold `n` elements.
template <class T>
bool check_compressed(Cursor c, uint64_t n, Problem& problem) {
    if constexpr (is_float_of_arrays<T>) {
        const uint64_t at = c.at();
        const char code = c.read<char>();
        if (c.ok() && code != 'i' && code != 't') {
            c.fail_at(at, fmt::format("code {} of a compressed array", int(code)), "'i' or 't'");
        }
        if (code == 't') c.take(uint64_t(c.read<uint32_t>()) * sizeof(T));
    }
    const uint64_t at = c.at();
    const auto size = c.read<uint64_t>();
    c.take(size);
    if (n > max_decoded_integers(size)) {
        c.fail_at(at, fmt::format("{} elements in {} compressed bytes", n, size), "fewer");
    }
    problem = c.problem();
    return c.ok();
}

template <class T>
std::shared_ptr<const layer::ArrayData> make_array(const CrateFilePtr& file,
                                                   ValueRep rep,
                                                   Problem& problem) {
    const Version version = file->version;
    Cursor c(file->bytes(), rep.payload());
    // A rank, always 1
    if (version < Version{0, 5, 0}) c.read<uint32_t>();
    const uint64_t count_at = c.at();
    const uint64_t n = version < Version{0, 7, 0} ? c.read<uint32_t>() : c.read<uint64_t>();
    const bool can_be_compressed = (is_integer_of_arrays<T> && version >= Version{0, 5, 0}) ||
                                   (is_float_of_arrays<T> && version >= Version{0, 6, 0});
    const bool is_compressed =
        rep.is_compressed() && can_be_compressed && n >= min_compressed_array;
    if (c.ok() && !is_compressed && n > c.left() / stored_size<T>()) {
        c.fail_at(count_at, fmt::format("an array of {} elements", n),
                  fmt::format("no more than there are in {} bytes", c.left()));
    }
    problem = c.problem();
    if (!c.ok() || (is_compressed && !check_compressed<T>(c, n, problem))) return nullptr;
    const std::string_view stored = file->bytes().substr(c.at());
    if constexpr (is_stored_plain<T>) {
        const bool is_aligned = reinterpret_cast<uintptr_t>(stored.data()) % alignof(T) == 0;
        if (!is_compressed && is_aligned) {
            return std::make_shared<const MappedArray>(file, stored.data(), size_t(n));
        }
    }
    if (!file->reserve_memory(n * sizeof(T))) {
        problem = {
            count_at,
            fmt::format("found arrays that take more than {} bytes when decoded, "
                        "expected less in a file of {} bytes, limit reached (--limit array-bytes)",
                        file->max_copied_bytes(), file->bytes().size())};
        return nullptr;
    }
    return std::make_shared<const DecodedArray<T>>(file, stored, size_t(n), is_compressed);
}

}  // namespace

bool read_array(
    const CrateFilePtr& file, ValueRep rep, bool is_shared, layer::Value& out, Problem& problem) {
    bool is_read = false;
    const bool is_known = visit_attribute_type(rep.type(), [&]<class T>(const T*) {
        if (rep.payload() == 0) {
            out = layer::Value::array<T>({});
            is_read = true;
            return;
        }
        const auto make = [&] { return make_array<T>(file, rep, problem); };
        auto array = is_shared ? file->shared_array(rep, make) : make();
        if (!array) return;
        out = layer::Value::array(layer::value_type_of<T>, std::move(array));
        is_read = true;
    });
    if (is_known) return is_read;
    problem = {rep.payload(),
               fmt::format("found an array of type {}, expected an array type", int(rep.type()))};
    return false;
}

}  // namespace velatura::usd::crate
