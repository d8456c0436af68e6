// SPDX-License-Identifier: Apache-2.0
#include "lights/light_selector.h"

#include "lights/emissive_surfaces.h"
#include "lights/light_tree.h"
#include "lights/linked_selector.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace velatura::lights {
namespace {

/// Chooses by fixed probabilities.
class Table {
  public:
    Table() = default;

    explicit Table(const std::vector<double>& weights) {
        double sum = 0.0;
        for (const double w : weights) sum += w;
        if (!(sum > 0.0)) return;
        double running = 0.0;
        for (size_t i = 0; i < weights.size(); ++i) {
            if (!(weights[i] > 0.0)) continue;
            running += weights[i] / sum;
            cdf_.push_back(running);
            pmf_.push_back(float(weights[i] / sum));
            number_.push_back(uint32_t(i));
        }
        cdf_.back() = 1.0;
    }

    bool is_empty() const { return cdf_.empty(); }

    /// The only number with weight.
    std::optional<uint32_t> single() const {
        return number_.size() == 1 ? std::optional(number_.front()) : std::nullopt;
    }

    struct Choice {
        uint32_t number = 0;
        float pmf = 0;
        double rest = 0;  // of the random number
    };

    Choice select(double u) const {
        const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), u);
        const size_t i = std::min(size_t(it - cdf_.begin()), cdf_.size() - 1);
        const double before = i > 0 ? cdf_[i - 1] : 0.0;
        const double rest = (u - before) / (cdf_[i] - before);
        return {number_[i], pmf_[i], std::clamp(rest, 0.0, 1.0 - 0x1p-53)};
    }

    float pmf(uint32_t number) const {
        const auto it = std::lower_bound(number_.begin(), number_.end(), number);
        return it != number_.end() && *it == number ? pmf_[size_t(it - number_.begin())] : 0.0f;
    }

  private:
    // Of the numbers with weight
    std::vector<double> cdf_;  // ends with 1
    std::vector<float> pmf_;
    std::vector<uint32_t> number_;
};

/// The same probabilities everywhere.
class TableSelector final : public LightSelector {
  public:
    TableSelector(const LightSet& lights,
                  const Box3& bounds,
                  const SelectorOptions& options,
                  const std::vector<bool>* among)
        : lights_(lights) {
        const bool by_power = options.kind == SelectionKind::Power;
        const bool by_area = options.kind == SelectionKind::Area;
        const double uniform = std::clamp(options.uniform_part, 1e-3, 1.0);
        const std::vector<double> ones = only(among, counts());
        lights_table_ = Table(by_power  ? blend(ones, only(among, powers(bounds)), uniform)
                              : by_area ? areas(ones)
                                        : ones);
        const EmissiveSurfaces* surfaces = lights.surfaces();
        if (surfaces == nullptr) return;
        for (uint32_t group = 0; group < surfaces->group_count(); ++group) {
            std::vector<double> on, power, area;
            for (uint32_t part = 0; part < surfaces->group_size(group); ++part) {
                power.push_back(surfaces->part_power(group, part));
                on.push_back(power.back() > 0.0 ? 1.0 : 0.0);
                area.push_back(on.back() * surfaces->part_area(group, part));
            }
            group_tables_.emplace_back(by_power ? blend(on, power, uniform) : by_area ? area : on);
        }
    }

    bool is_empty() const override { return lights_table_.is_empty(); }

    bool is_single() const override {
        const std::optional<uint32_t> item = lights_table_.single();
        return item && !lights_.is_instance(*item);
    }

    std::optional<LightChoice> select(const Receiver&, double u) const override {
        if (is_empty()) return std::nullopt;
        const Table::Choice choice = lights_table_.select(u);
        if (!lights_.is_instance(choice.number)) return LightChoice{choice.number, choice.pmf};
        const Table& parts = group_tables_[lights_.group_of_instance(choice.number)];
        const Table::Choice part = parts.select(choice.rest);
        return LightChoice{LightId(choice.number, part.number), choice.pmf * part.pmf};
    }

    float pmf(const Receiver&, LightId light) const override {
        const float pmf = lights_table_.pmf(light.index);
        if (!(pmf > 0.0f) || !lights_.is_instance(light.index)) return pmf;
        return pmf * group_tables_[lights_.group_of_instance(light.index)].pmf(light.part);
    }

  private:
    /// Nothing of the items that are left out.
    static std::vector<double> only(const std::vector<bool>* among, std::vector<double> weights) {
        for (size_t i = 0; among && i < weights.size(); ++i)
            if (!(*among)[i]) weights[i] = 0.0;
        return weights;
    }

    /// How many lights that are on stand behind each item.
    std::vector<double> counts() const {
        std::vector<double> result(lights_.item_count(), 0.0);
        std::vector<double> of_group;
        for (uint32_t i = 0; i < result.size(); ++i) {
            if (!lights_.is_instance(i)) {
                result[i] = lights_.is_on(i) ? 1.0 : 0.0;
                continue;
            }
            const uint32_t group = lights_.group_of_instance(i);
            if (of_group.empty()) of_group.assign(lights_.surfaces()->group_count(), -1.0);
            if (of_group[group] < 0.0) {
                of_group[group] = 0.0;
                for (uint32_t part = 0; part < lights_.surfaces()->group_size(group); ++part)
                    of_group[group] += lights_.is_on(LightId(i, part)) ? 1.0 : 0.0;
            }
            result[i] = of_group[group];
        }
        return result;
    }

    /// Of every item.
    std::vector<double> powers(const Box3& bounds) const {
        const Vec3d size(bounds.isEmpty() ? Vec3(0.0f) : bounds.size());
        const double radius = 0.5 * std::sqrt(size.dot(size));
        std::vector<double> result(lights_.item_count(), 0.0);
        for (uint32_t i = 0; i < result.size(); ++i) result[i] = lights_.power(i, radius);
        return result;
    }

    /// Of every item. counts: those of which there are any.
    std::vector<double> areas(const std::vector<double>& counts) const {
        std::vector<double> result(counts.size(), 0.0);
        double area = 0.0, finite = 0.0;
        for (uint32_t i = 0; i < result.size(); ++i) {
            if (!(counts[i] > 0.0)) continue;
            result[i] = lights_.area(i);
            area += result[i];
            if (result[i] > 0.0) finite += counts[i];
        }
        const double mean = area > 0.0 ? area / finite : 1.0;
        for (uint32_t i = 0; i < result.size(); ++i)
            if (!(result[i] > 0.0)) result[i] = counts[i] * mean;
        return result;
    }

    /// `uniform` parts of one distribution, the rest of the other; the first alone when the second
    /// has no finite sum.
    static std::vector<double> blend(const std::vector<double>& a,
                                     const std::vector<double>& b,
                                     double uniform) {
        double sum_a = 0.0, sum_b = 0.0;
        for (size_t i = 0; i < a.size(); ++i) {
            sum_a += a[i];
            sum_b += b[i];
        }
        if (!(sum_b > 0.0) || !std::isfinite(sum_b) || !(sum_a > 0.0)) return a;
        std::vector<double> result;
        for (size_t i = 0; i < a.size(); ++i)
            result.push_back(uniform * (a[i] / sum_a) + (1.0 - uniform) * (b[i] / sum_b));
        return result;
    }

    const LightSet& lights_;
    Table lights_table_;
    std::vector<Table> group_tables_;
};

}  // namespace

std::unique_ptr<LightSelector> make_light_selector(const LightSet& lights,
                                                   const Box3& scene_bounds,
                                                   const SelectorOptions& options) {
    const auto make = [&](const std::vector<bool>* among) -> std::unique_ptr<LightSelector> {
        if (options.kind == SelectionKind::Tree) return std::make_unique<LightTree>(lights, among);
        return std::make_unique<TableSelector>(lights, scene_bounds, options, among);
    };
    if (lights.has_light_links()) return std::make_unique<LinkedSelector>(lights, make);
    return make(nullptr);
}

bool wants_fine_numbers(const LightSet& lights) {
    constexpr size_t few = size_t(1) << 16;
    size_t count = 0;
    for (uint32_t i = 0; i < lights.item_count() && count <= few; ++i)
        count += lights.is_instance(i) ? lights.surfaces()->part_count(i - lights.size()) : 1;
    return count > few;
}

}  // namespace velatura::lights
