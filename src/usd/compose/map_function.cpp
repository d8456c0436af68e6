// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/map_function.h"

#include <algorithm>

namespace velatura::usd::compose {

using layer::Path;

namespace {

/// Image of a plain prim or property path under the pair with the longest matching prefix.
Path map_plain(const std::vector<MapFunction::PathPair>& pairs, Path path, bool invert) {
    const MapFunction::PathPair* best = nullptr;
    size_t best_length = 0;
    for (const auto& pair : pairs) {
        const Path from = invert ? pair.second : pair.first;
        if (from.is_empty() || !path.has_prefix(from)) continue;
        const size_t length = from.element_count();
        if (!best || length >= best_length) {
            best = &pair;
            best_length = length;
        }
    }
    if (!best) return {};
    const Path from = invert ? best->second : best->first;
    const Path to = invert ? best->first : best->second;
    if (to.is_empty()) return {};
    const Path result = from == to ? path : path.replace_prefix(from, to, false);

    // Refuse an image that a deeper pair owns: the map would not be one to one
    const size_t to_length = to.element_count();
    for (const auto& pair : pairs) {
        if (&pair == best) continue;
        const Path other = invert ? pair.first : pair.second;
        if (other.is_empty()) continue;
        if (other.element_count() > to_length && result.has_prefix(other)) return {};
    }
    return result;
}

}  // namespace

MapFunction::MapFunction(std::vector<PathPair> pairs, TimeOffset offset)
    : pairs_(std::move(pairs)), offset_(offset) {
    canonicalize();
}

MapFunction MapFunction::identity(TimeOffset offset) {
    const Path root = Path::absolute_root();
    return MapFunction({{root, root}}, offset);
}

void MapFunction::canonicalize() {
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());

    // Drop pairs that the remaining ones imply
    for (size_t i = 0; i < pairs_.size();) {
        const PathPair pair = pairs_[i];
        std::vector<PathPair> rest = pairs_;
        rest.erase(rest.begin() + std::ptrdiff_t(i));
        bool implied = false;
        if (pair.second.is_empty()) {
            implied = map_plain(rest, pair.first, false).is_empty();
        } else {
            const PathPair* nearest = nullptr;
            for (const auto& other : rest) {
                if (pair.first.has_prefix(other.first) &&
                    (!nearest || other.first.element_count() > nearest->first.element_count())) {
                    nearest = &other;
                }
            }
            implied =
                nearest && !nearest->second.is_empty() &&
                pair.first.replace_prefix(nearest->first, nearest->second, false) == pair.second;
        }
        if (implied) {
            pairs_.erase(pairs_.begin() + std::ptrdiff_t(i));
        } else {
            ++i;
        }
    }
}

Path MapFunction::map(Path path, bool invert) const {
    if (path.is_empty()) return {};
    if (!path.has_target()) return map_plain(pairs_, path, invert);

    // Map the target inside, then the path around it
    if (path.is_target()) {
        const Path owner = map(path.parent(), invert);
        const Path target = map(path.target(), invert);
        return owner.is_empty() || target.is_empty() ? Path() : owner.append_target(target);
    }
    if (path.kind() == layer::PathKind::RelationalAttribute) {
        const Path owner = map(path.parent(), invert);
        return owner.is_empty() ? Path() : owner.append_relational_attribute(path.name());
    }
    return map_plain(pairs_, path, invert);
}

Path MapFunction::to_target(Path path) const {
    return map(path, false);
}

Path MapFunction::to_source(Path path) const {
    return map(path, true);
}

MapFunction MapFunction::after(const MapFunction& inner) const {
    if (is_identity()) return inner;
    if (inner.is_identity()) return *this;
    std::vector<PathPair> pairs;
    pairs.reserve(pairs_.size() + inner.pairs_.size());
    for (const auto& pair : inner.pairs_) {
        if (pair.second.is_empty()) {
            pairs.push_back(pair);
            continue;
        }
        const Path target = map_plain(pairs_, pair.second, false);
        // A source that maps nowhere must block what a shorter pair would map
        pairs.emplace_back(pair.first, target);
    }
    for (const auto& pair : pairs_) {
        const Path source = map_plain(inner.pairs_, pair.first, true);
        if (source.is_empty()) continue;
        const bool known = std::any_of(pairs.begin(), pairs.end(),
                                       [&](const PathPair& p) { return p.first == source; });
        if (!known) pairs.emplace_back(source, pair.second);
    }
    // Blocks that block nothing are dropped by canonicalize
    return MapFunction(std::move(pairs), offset_.after(inner.offset_));
}

MapFunction MapFunction::inverse() const {
    std::vector<PathPair> pairs;
    pairs.reserve(pairs_.size());
    for (const auto& pair : pairs_) {
        if (!pair.second.is_empty()) pairs.emplace_back(pair.second, pair.first);
    }
    return MapFunction(std::move(pairs), offset_.inverse());
}

MapFunction MapFunction::with_root_identity() const {
    if (has_root_identity()) return *this;
    std::vector<PathPair> pairs = pairs_;
    const Path root = Path::absolute_root();
    pairs.emplace_back(root, root);
    return MapFunction(std::move(pairs), offset_);
}

bool MapFunction::has_root_identity() const {
    return std::any_of(pairs_.begin(), pairs_.end(), [](const PathPair& p) {
        return p.first.is_absolute_root() && p.second.is_absolute_root();
    });
}

bool MapFunction::is_identity() const {
    return pairs_.size() == 1 && has_root_identity() && offset_.is_identity();
}

}  // namespace velatura::usd::compose
