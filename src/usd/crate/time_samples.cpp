// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/time_samples.h"

#include "usd/crate/value_reader.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace velatura::usd::crate {

namespace {

class FileSamples final : public layer::TimeSampleSource {
  public:
    /// `order`: the place in the file of each sample; empty when they lie there in order.
    FileSamples(CrateFilePtr file, uint64_t values_at, std::vector<uint32_t> order)
        : file_(std::move(file)), values_at_(values_at), order_(std::move(order)) {}

    layer::Value value(size_t i) const override {
        const uint64_t place = order_.empty() ? i : order_[i];
        ValueRep rep;
        std::memcpy(&rep.bits, file_->bytes().data() + values_at_ + place * sizeof rep.bits,
                    sizeof rep.bits);
        // A sample is worth no more than the whole layer
        ValueReader reader(file_, file_->max_copied_bytes(), true);
        layer::Value result;
        if (reader.read(rep, result)) return result;
        file_->report_late(reader.problem());
        return layer::Value::block();
    }

  private:
    CrateFilePtr file_;
    uint64_t values_at_;
    std::vector<uint32_t> order_;
};

}  // namespace

layer::TimeSamples make_time_samples(CrateFilePtr file,
                                     std::vector<double> times,
                                     uint64_t values_at) {
    std::vector<uint32_t> order;
    const auto not_after = [](double a, double b) { return a >= b; };
    if (std::adjacent_find(times.begin(), times.end(), not_after) != times.end()) {
        order.resize(times.size());
        std::iota(order.begin(), order.end(), 0u);
        std::stable_sort(order.begin(), order.end(),
                         [&](uint32_t a, uint32_t b) { return times[a] < times[b]; });
        std::vector<uint32_t> kept;
        std::vector<double> sorted;
        for (const uint32_t i : order) {
            if (!sorted.empty() && sorted.back() == times[i]) {
                kept.back() = i;
                continue;
            }
            kept.push_back(i);
            sorted.push_back(times[i]);
        }
        order = std::move(kept);
        times = std::move(sorted);
    }
    return layer::TimeSamples(
        std::make_shared<const std::vector<double>>(std::move(times)),
        std::make_shared<const FileSamples>(std::move(file), values_at, std::move(order)));
}

}  // namespace velatura::usd::crate
