// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/placement_copies.h"

#include "base/hash.h"
#include "translate/context/instance_source.h"
#include "translate/linking/linking.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace velatura::translate::instancing {

namespace {

class CopyRemover {
  public:
    explicit CopyRemover(Context& ctx) : ctx_(ctx) {}

    void visit(InstanceSource& content) {
        if (!visited_.insert(&content).second) return;
        for (const Placement& placement : content.placements) visit(*placement.what);
        if (content.placements.size() > 1) remove_from(content.placements);
    }

    void warn() const {
        if (count_ == 0) return;
        const scene::Provenance& p = ctx_.scene.provenance[first_];
        ctx_.diagnostics.warn(
            "duplicate-instances", p.loc, p.prim_path,
            fmt::format("{} duplicate instances, at the same place as others of the same "
                        "prototype, are skipped; the first is this prim's",
                        count_));
    }

  private:
    void remove_from(std::vector<Placement>& placements) {
        std::vector<std::pair<uint64_t, size_t>> by_hash;
        by_hash.reserve(placements.size());
        for (size_t i = 0; i < placements.size(); ++i) by_hash.emplace_back(hash(placements[i]), i);
        std::sort(by_hash.begin(), by_hash.end());
        std::vector<bool> is_left_out(placements.size());
        for (size_t i = 1, first = 0; i < by_hash.size(); ++i) {
            if (by_hash[i].first != by_hash[first].first)
                first = i;
            else if (is_copy(placements[by_hash[i].second], placements[by_hash[first].second]))
                is_left_out[by_hash[i].second] = true;
        }
        const auto copy = std::find(is_left_out.begin(), is_left_out.end(), true);
        if (copy == is_left_out.end()) return;
        if (count_ == 0) first_ = placements[size_t(copy - is_left_out.begin())].provenance;
        count_ += std::erase_if(placements, [&](const Placement& placement) {
            return is_left_out[size_t(&placement - placements.data())];
        });
    }

    std::span<const scene::InstanceValue> values_of(const Placement& placement) const {
        return std::span(ctx_.scene.instance_values)
            .subspan(placement.first_value, placement.value_count);
    }

    uint64_t hash(const Placement& placement) const {
        uint64_t h = std::bit_cast<uintptr_t>(placement.what);
        // +0 and -0 are the same place
        for (int r = 0; r < 4; ++r)
            for (int c = 0; c < 3; ++c)
                h = hash_combine(h, std::bit_cast<uint64_t>(placement.matrix[r][c] + 0.0));
        for (const scene::InstanceValue& value : values_of(placement))
            for (const float v : value.values)
                h = hash_combine(h, std::bit_cast<uint32_t>(v + 0.0f));
        if (ctx_.state<linking::LinkPathMappings>().is_kept)
            h = hash_combine(h, placement.provenance);
        return h;
    }

    bool is_copy(const Placement& a, const Placement& b) {
        return a.what == b.what && a.matrix == b.matrix && a.later == b.later &&
               std::ranges::equal(values_of(a), values_of(b)) &&
               (a.provenance == b.provenance || !ctx_.state<linking::LinkPathMappings>().is_kept) &&
               !adds_up(*a.what);
    }

    /// Whether several in one place are more than one.
    bool adds_up(const InstanceSource& what) {
        const auto known = adds_up_.find(&what);
        if (known != adds_up_.end()) return known->second;
        const bool result =
            !what.lights.empty() || !what.volumes.empty() ||
            std::any_of(what.placements.begin(), what.placements.end(),
                        [&](const Placement& nested) { return adds_up(*nested.what); });
        adds_up_.emplace(&what, result);
        return result;
    }

    Context& ctx_;
    std::unordered_set<const InstanceSource*> visited_;
    std::unordered_map<const InstanceSource*, bool> adds_up_;
    size_t count_ = 0;
    scene::ProvenanceId first_ = scene::none;
};

}  // namespace

void omit_copies(Context& ctx, InstanceSource& content) {
    CopyRemover remover(ctx);
    remover.visit(content);
    remover.warn();
}

}  // namespace velatura::translate::instancing
