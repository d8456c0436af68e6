// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composition_error.h"

#include <numeric>

namespace velatura::usd::compose {

namespace {

struct KindText {
    std::string_view name;
    std::string_view code;
};

// In the order of ErrorKind
constexpr std::array<KindText, error_kind_count> kind_texts = {{
    {"arc-cycle", "usd-arc-cycle"},
    {"arc-to-prohibited-child", "usd-arc-to-relocated-prim"},
    {"capacity-exceeded", "usd-too-many-arcs"},
    {"inconsistent-property-type", "usd-inconsistent-property"},
    {"invalid-asset-path", "usd-unresolved-asset"},
    {"invalid-authored-relocation", "usd-invalid-relocate"},
    {"invalid-conflicting-relocation", "usd-conflicting-relocates"},
    {"invalid-external-target-path", "usd-target-outside-arc"},
    {"invalid-instance-target-path", "usd-target-in-instance"},
    {"invalid-prim-path", "usd-invalid-arc-path"},
    {"invalid-reference-offset", "usd-bad-layer-offset"},
    {"invalid-same-target-relocations", "usd-conflicting-relocates"},
    {"invalid-sublayer-offset", "usd-bad-layer-offset"},
    {"invalid-sublayer-ownership", "usd-sublayer-owners"},
    {"invalid-sublayer-path", "usd-unresolved-sublayer"},
    {"opinion-at-relocation-source", "usd-opinion-at-relocation-source"},
    {"sublayer-cycle", "usd-sublayer-cycle"},
    {"unresolved-prim-path", "usd-unresolved-prim-path"},
    {"variable-expression", "usd-bad-expression"},
}};

}  // namespace

std::string_view error_name(ErrorKind kind) {
    return kind_texts[size_t(kind)].name;
}

void CompositionErrors::add(CompositionError error, std::string_view code) {
    if (code.empty()) code = kind_texts[size_t(error.kind)].code;
    const bool about_prim = !error.prim.is_empty() && !error.prim.is_absolute_root();
    diagnostics_.error(std::string(code), error.loc, about_prim ? error.prim.to_string() : "",
                       error.message);
    const std::lock_guard lock(mutex_);
    ++counts_[size_t(error.kind)];
    if (errors_.size() < stored_limit) errors_.push_back(std::move(error));
}

std::vector<CompositionError> CompositionErrors::all() const {
    const std::lock_guard lock(mutex_);
    return errors_;
}

size_t CompositionErrors::count() const {
    const std::lock_guard lock(mutex_);
    return std::accumulate(counts_.begin(), counts_.end(), size_t(0));
}

size_t CompositionErrors::count(ErrorKind kind) const {
    const std::lock_guard lock(mutex_);
    return counts_[size_t(kind)];
}

}  // namespace velatura::usd::compose
