// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/relocations.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace velatura::usd::compose {

using layer::Path;

namespace {

constexpr size_t max_relocates = 10'000;  ///< of one layer stack

/// Why a relocation can never be; nullptr when it can.
const char* fault_of(Path source, Path target) {
    const auto path_fault = [](Path path) -> const char* {
        if (!path.is_absolute()) return "paths must be absolute";
        if (path.has_variant_selection()) return "paths must not hold variant selections";
        return path.is_prim() ? nullptr : "only prims can be relocated";
    };
    if (source.is_empty()) return "the source is empty";
    if (const char* fault = path_fault(source)) return fault;
    if (!target.is_empty()) {
        if (const char* fault = path_fault(target)) return fault;
        if (source == target) return "the target is the source";
        if (target.has_prefix(source)) return "the target is below its source";
        if (source.has_prefix(target)) return "the target is an ancestor of its source";
    }
    return source.is_root_prim() ? "a root prim cannot be the source" : nullptr;
}

/// Collects the statements that can stand together.
class RelocateChecker {
  public:
    explicit RelocateChecker(std::vector<CompositionError>& errors) : errors_(errors) {}

    /// The strongest statement about each source, those in conflict taken out.
    std::map<Path, const AuthoredRelocate*> valid(const std::vector<AuthoredRelocate>& authored) {
        for (const AuthoredRelocate& relocate : authored) {
            if (by_source_.size() >= max_relocates) {
                reject(ErrorKind::CapacityExceeded, relocate,
                       fmt::format("limit of {} relocations reached", max_relocates));
                break;
            }
            if (const char* fault = fault_of(relocate.source, relocate.target)) {
                reject(ErrorKind::InvalidAuthoredRelocation, relocate, fault);
            } else {
                by_source_.emplace(relocate.source, &relocate);
            }
        }
        check_targets();
        for (const auto& entry : by_source_) check_conflicts(*entry.second);
        for (const Path& source : refused_) by_source_.erase(source);
        return std::move(by_source_);
    }

  private:
    void reject(ErrorKind kind, const AuthoredRelocate& relocate, const std::string& why) {
        const std::string target =
            relocate.target.is_empty() ? "" : " to <" + relocate.target.to_string() + ">";
        CompositionError error;
        error.kind = kind;
        error.prim = Path::absolute_root();
        error.layer_stack = relocate.layer;
        error.site = relocate.source;
        error.loc = relocate.loc;
        error.message = fmt::format("relocation of <{}>{} is ignored: {}",
                                    relocate.source.to_string(), target, why);
        errors_.push_back(std::move(error));
    }

    void check_targets() {
        std::map<Path, std::vector<const AuthoredRelocate*>> by_target;
        for (const auto& [source, relocate] : by_source_) {
            if (!relocate->target.is_empty()) by_target[relocate->target].push_back(relocate);
        }
        for (const auto& [target, claims] : by_target) {
            if (claims.size() < 2) continue;
            std::string others;
            for (const AuthoredRelocate* claim : claims) {
                refused_.insert(claim->source);
                if (claim != claims.front()) others += " <" + claim->source.to_string() + ">";
            }
            reject(ErrorKind::InvalidSameTargetRelocations, *claims.front(),
                   "other prims are relocated to the same place:" + others);
        }
    }

    void conflict(const AuthoredRelocate& relocate,
                  const AuthoredRelocate& other,
                  const char* why) {
        refused_.insert(relocate.source);
        reject(ErrorKind::InvalidConflictingRelocation, relocate,
               fmt::format("{} <{}>", why, other.source.to_string()));
    }

    void check_conflicts(const AuthoredRelocate& relocate) {
        if (!relocate.target.is_empty()) {
            const auto moved_on = by_source_.find(relocate.target);
            if (moved_on != by_source_.end()) {
                conflict(relocate, *moved_on->second, "its target is the source of another, of");
                conflict(*moved_on->second, relocate, "its source is the target of another, of");
            }
            for (Path p = relocate.target.parent(); !p.is_absolute_root(); p = p.parent()) {
                const auto outer = by_source_.find(p);
                if (outer == by_source_.end()) continue;
                conflict(relocate, *outer->second, "its target is below the source of another, of");
            }
        }
        for (Path p = relocate.source.parent(); !p.is_root_prim(); p = p.parent()) {
            const auto outer = by_source_.find(p);
            if (outer == by_source_.end()) continue;
            conflict(relocate, *outer->second, "its source is below the source of another, of");
        }
    }

    std::vector<CompositionError>& errors_;
    std::map<Path, const AuthoredRelocate*> by_source_;
    std::set<Path> refused_;
};

constexpr size_t max_nested_relocates = 64;

/// Where a source comes from before any relocation of its ancestors.
Path origin_of(Path source, const Relocations::PathMap& source_of) {
    for (size_t step = 0; step < max_nested_relocates; ++step) {
        auto outer = source_of.end();
        for (Path p = source; !p.is_empty() && outer == source_of.end(); p = p.parent())
            outer = source_of.find(p);
        if (outer == source_of.end()) break;
        const Path before = source.replace_prefix(outer->first, outer->second, false);
        if (before.is_empty()) break;
        source = before;
    }
    return source;
}

}  // namespace

Relocations::Relocations(const std::vector<AuthoredRelocate>& authored,
                         std::vector<CompositionError>& errors) {
    for (const auto& [source, relocate] : RelocateChecker(errors).valid(authored)) {
        target_of_.emplace(source, relocate->target);
        if (!relocate->target.is_empty()) source_of_.emplace(relocate->target, source);
    }
    for (const auto& [source, target] : target_of_)
        target_of_origin_.emplace(origin_of(source, source_of_), target);
}

Path Relocations::source(Path target) const {
    const auto found = source_of_.find(target);
    return found == source_of_.end() ? Path() : found->second;
}

const MapFunction& Relocations::map_below(Path path) const {
    const auto known = maps_.find(path);
    if (known != maps_.end()) return known->second;
    // Of an origin and a single step with one target the origin counts: the map is one to one
    PathMap pairs;
    std::set<Path> targets;
    for (const PathMap* map : {&target_of_origin_, &target_of_}) {
        for (auto it = map->lower_bound(path); it != map->end() && it->first.has_prefix(path);
             ++it) {
            if (!it->second.is_empty() && targets.insert(it->second).second) pairs.insert(*it);
        }
    }
    pairs.emplace(Path::absolute_root(), Path::absolute_root());
    return maps_.emplace(path, MapFunction({pairs.begin(), pairs.end()}, {})).first->second;
}

}  // namespace velatura::usd::compose
