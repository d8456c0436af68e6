// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/value.h"

#include "usd/layer/spline.h"

#include <algorithm>
#include <array>

namespace velatura::usd::layer {

namespace {

using EqualFunction = bool (*)(const Value&, const Value&);

template <class T>
bool equal_as(const Value& a, const Value& b) {
    if (!a.is_array()) return *a.get_if<T>() == *b.get_if<T>();
    const std::span<const T> x = a.as_array<T>();
    const std::span<const T> y = b.as_array<T>();
    return x.size() == y.size() &&
           (x.data() == y.data() || std::equal(x.begin(), x.end(), y.begin()));
}

template <size_t... I>
constexpr auto equal_functions(std::index_sequence<I...>) {
    return std::array<EqualFunction, sizeof...(I)>{
        &equal_as<std::tuple_element_t<I, ValueTypeList>>...};
}

class SamplesAtHand final : public TimeSampleSource {
  public:
    explicit SamplesAtHand(std::vector<Value> values) : values_(std::move(values)) {}

    Value value(size_t i) const override { return values_[i]; }

  private:
    std::vector<Value> values_;
};

}  // namespace

Value Value::array(ValueType element_type, std::shared_ptr<const ArrayData> data) {
    VELATURA_CHECK(is_attribute_type(element_type) && data,
                   "arrays have elements of an attribute type");
    Value v(element_type);
    v.is_array_ = true;
    // The base pointer itself is kept, so that a static_cast from void gets it back
    v.hold(Held(data, static_cast<const void*>(data.get())));
    return v;
}

bool Value::operator==(const Value& o) const {
    static constexpr auto equal =
        equal_functions(std::make_index_sequence<std::tuple_size_v<ValueTypeList>>());
    if (type_ != o.type_ || is_array_ != o.is_array_) return false;
    if (type_ >= ValueType::Block) return true;
    return equal[size_t(type_)](*this, o);
}

Dictionary Dictionary::merged_over(const Dictionary& weaker) const {
    Dictionary result = weaker;
    for (const auto& [key, value] : entries) {
        Value& slot = result.entries[key];
        const Dictionary* mine = value.get_if<Dictionary>();
        const Dictionary* theirs = slot.get_if<Dictionary>();
        slot = mine && theirs ? Value(mine->merged_over(*theirs)) : value;
    }
    return result;
}

TimeSamples::TimeSamples(std::vector<std::pair<double, Value>> samples) {
    std::stable_sort(samples.begin(), samples.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<double> times;
    std::vector<Value> values;
    times.reserve(samples.size());
    values.reserve(samples.size());
    for (auto& [time, value] : samples) {
        if (!times.empty() && times.back() == time) {
            values.back() = std::move(value);
            continue;
        }
        times.push_back(time);
        values.push_back(std::move(value));
    }
    times_ = std::make_shared<const std::vector<double>>(std::move(times));
    source_ = std::make_shared<const SamplesAtHand>(std::move(values));
}

TimeSamples::TimeSamples(std::shared_ptr<const std::vector<double>> times,
                         std::shared_ptr<const TimeSampleSource> source)
    : times_(std::move(times)), source_(std::move(source)) {}

Value TimeSamples::value_at(double t) const {
    const std::span<const double> all = times();
    const auto it = std::lower_bound(all.begin(), all.end(), t);
    return it != all.end() && *it == t ? value(size_t(it - all.begin())) : Value();
}

bool TimeSamples::operator==(const TimeSamples& o) const {
    if (!std::ranges::equal(times(), o.times())) return false;
    for (size_t i = 0; i < size(); ++i) {
        if (!(value(i) == o.value(i))) return false;
    }
    return true;
}

}  // namespace velatura::usd::layer
