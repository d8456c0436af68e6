// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/check.h"
#include "usd/layer/list_op.h"
#include "usd/layer/types.h"
#include "usd/layer/value_type.h"

#include <cstddef>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

/// Elements of an array value. Size is known at once; data may be brought in on first use (a mapped
/// or compressed file), so data() must be thread-safe. Never changes.
class ArrayData {
  public:
    virtual ~ArrayData() = default;
    virtual size_t size() const = 0;
    /// First of size() contiguous elements of the C++ type of the array's ValueType.
    virtual const void* data() const = 0;
};

/// Any value of a field: scalar, array, dictionary, list-op, time samples, block, … 32 bytes, cheap
/// to copy: what is large is shared and never changes.
class Value {
  public:
    Value() = default;

    template <ValueElement T>
    explicit Value(T value) : type_(value_type_of<T>) {
        if constexpr (is_inline<T>) {
            new (storage_) T(std::move(value));
        } else {
            hold(std::make_shared<const T>(std::move(value)));
        }
    }

    static Value block() { return Value(ValueType::Block); }

    static Value animation_block() { return Value(ValueType::AnimationBlock); }

    /// An array that owns its elements.
    template <ValueElement T>
    static Value array(std::vector<T> elements);
    /// An array whose elements come from elsewhere, such as a file.
    static Value array(ValueType element_type, std::shared_ptr<const ArrayData> data);

    Value(const Value& o) { copy_from(o); }

    Value(Value&& o) noexcept { take_from(o); }

    Value& operator=(const Value& o) {
        if (this != &o) {
            release();
            copy_from(o);
        }
        return *this;
    }

    Value& operator=(Value&& o) noexcept {
        if (this != &o) {
            release();
            take_from(o);
        }
        return *this;
    }

    ~Value() { release(); }

    ValueType type() const { return type_; }

    bool is_array() const { return is_array_; }

    bool is_empty() const { return type_ == ValueType::Empty; }

    /// `None`.
    bool is_block() const { return type_ == ValueType::Block; }

    bool is_animation_block() const { return type_ == ValueType::AnimationBlock; }

    /// The scalar or field value when it is exactly a T, else nullptr.
    template <ValueElement T>
    const T* get_if() const {
        if (type_ != value_type_of<T> || is_array_) return nullptr;
        if constexpr (is_inline<T>) {
            return std::launder(reinterpret_cast<const T*>(storage_));
        } else {
            return static_cast<const T*>(held().get());
        }
    }

    template <ValueElement T>
    bool holds() const {
        return type_ == value_type_of<T> && !is_array_;
    }

    template <ValueElement T>
    T get_or(T otherwise) const {
        const T* v = get_if<T>();
        return v ? *v : otherwise;
    }

    template <ValueElement T>
    bool holds_array() const {
        return type_ == value_type_of<T> && is_array_;
    }

    /// The elements when it is exactly an array of T, else an empty span; valid while some copy of
    /// the Value lives.
    template <ValueElement T>
    std::span<const T> as_array() const {
        if (!holds_array<T>()) return {};
        const ArrayData& data = *array_data();
        return {static_cast<const T*>(data.data()), data.size()};
    }

    size_t array_size() const { return is_array_ ? array_data()->size() : 0; }

    /// The shared elements of an array, else nullptr.
    const ArrayData* array_data() const {
        return is_array_ ? static_cast<const ArrayData*>(held().get()) : nullptr;
    }

    /// Same type and equal content (floats by ==, arrays element by element).
    bool operator==(const Value& o) const;

  private:
    using Held = std::shared_ptr<const void>;

    template <class T>
    static constexpr bool is_inline = sizeof(T) <= 24 && alignof(T) <= 8 && detail::is_plain<T>;

    explicit Value(ValueType type) : type_(type) {}

    const Held& held() const { return *std::launder(reinterpret_cast<const Held*>(storage_)); }

    void hold(Held h) {
        new (storage_) Held(std::move(h));
        is_held_ = true;
    }

    void copy_from(const Value& o) {
        type_ = o.type_;
        is_array_ = o.is_array_;
        is_held_ = false;
        if (o.is_held_) {
            hold(o.held());
        } else {
            std::memcpy(storage_, o.storage_, sizeof storage_);
        }
    }

    void take_from(Value& o) noexcept {
        // A shared_ptr may be moved bit by bit when the old one is forgotten
        std::memcpy(storage_, o.storage_, sizeof storage_);
        type_ = o.type_;
        is_array_ = o.is_array_;
        is_held_ = o.is_held_;
        o.type_ = ValueType::Empty;
        o.is_array_ = false;
        o.is_held_ = false;
    }

    void release() {
        if (is_held_) std::launder(reinterpret_cast<Held*>(storage_))->~Held();
        is_held_ = false;
    }

    alignas(8) std::byte storage_[24] = {};
    ValueType type_ = ValueType::Empty;
    bool is_array_ = false;
    bool is_held_ = false;
};

/// Named values, sorted by name bytes.
class Dictionary {
  public:
    using Entries = std::map<std::string, Value, std::less<>>;

    bool operator==(const Dictionary&) const = default;

    bool empty() const { return entries.empty(); }

    /// The value of a key, else nullptr.
    const Value* find(std::string_view key) const {
        const auto it = entries.find(key);
        return it == entries.end() ? nullptr : &it->second;
    }

    /// This dictionary's entries over `weaker`'s, nested dictionaries merged likewise.
    Dictionary merged_over(const Dictionary& weaker) const;

    Entries entries;
};

/// Values at times; lookups by index may bring the value in from a file.
class TimeSampleSource {
  public:
    virtual ~TimeSampleSource() = default;
    /// Value of sample i; thread-safe. A block is a block Value.
    virtual Value value(size_t i) const = 0;
};

/// Time samples: strictly ascending times and a value for each. Shares its content.
class TimeSamples {
  public:
    TimeSamples() = default;
    /// Samples at hand; sorts them, of equal times the last wins.
    explicit TimeSamples(std::vector<std::pair<double, Value>> samples);
    TimeSamples(std::shared_ptr<const std::vector<double>> times,
                std::shared_ptr<const TimeSampleSource> source);

    size_t size() const { return times_ ? times_->size() : 0; }

    bool empty() const { return size() == 0; }

    std::span<const double> times() const {
        return times_ ? std::span<const double>(*times_) : std::span<const double>();
    }

    Value value(size_t i) const { return source_->value(i); }

    /// Value of the sample exactly at t, else an empty Value.
    Value value_at(double t) const;

    bool operator==(const TimeSamples& o) const;

  private:
    std::shared_ptr<const std::vector<double>> times_;
    std::shared_ptr<const TimeSampleSource> source_;
};

/// A reference arc as authored: empty asset = internal; empty prim path = the target layer's
/// default prim.
struct Reference {
    std::string asset;
    Path prim_path;
    LayerOffset offset;
    Dictionary custom_data;

    bool operator==(const Reference&) const = default;
};

/// A payload arc as authored.
struct Payload {
    std::string asset;
    Path prim_path;
    LayerOffset offset;

    bool operator==(const Payload&) const = default;
};

namespace detail {
template <class T>
class OwnedArray final : public ArrayData {
  public:
    explicit OwnedArray(std::vector<T> elements) : elements_(std::move(elements)) {}

    size_t size() const override { return elements_.size(); }

    const void* data() const override { return elements_.data(); }

  private:
    std::vector<T> elements_;
};

template <>
class OwnedArray<bool> final : public ArrayData {
  public:
    explicit OwnedArray(const std::vector<bool>& elements)
        : size_(elements.size()), elements_(std::make_unique<bool[]>(elements.size())) {
        for (size_t i = 0; i < size_; ++i) elements_[i] = elements[i];
    }

    size_t size() const override { return size_; }

    const void* data() const override { return elements_.get(); }

  private:
    size_t size_;
    std::unique_ptr<bool[]> elements_;
};
}  // namespace detail

template <ValueElement T>
Value Value::array(std::vector<T> elements) {
    static_assert(is_attribute_type(value_type_of<T>));
    return array(value_type_of<T>,
                 std::make_shared<const detail::OwnedArray<T>>(std::move(elements)));
}

}  // namespace velatura::usd::layer

template <>
struct std::hash<velatura::usd::layer::Reference> {
    size_t operator()(const velatura::usd::layer::Reference& r) const {
        return std::hash<std::string>()(r.asset) * 31 + r.prim_path.hash();
    }
};

template <>
struct std::hash<velatura::usd::layer::Payload> {
    size_t operator()(const velatura::usd::layer::Payload& p) const {
        return std::hash<std::string>()(p.asset) * 31 + p.prim_path.hash();
    }
};
