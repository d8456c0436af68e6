// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/map_function.h"

#include "base/hash.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_map>

namespace velatura::usd::compose {

using layer::Path;

namespace {

using Pair = MapFunction::PathPair;
using Pairs = std::vector<Pair>;

/// The pair whose source (or target, when inverted) is the longest prefix of the path; of equals
/// the last. nullptr when none is at least `min` elements long.
const Pair* best_pair(const Pairs& pairs, Path path, bool invert, size_t min = 0) {
    const Pair* best = nullptr;
    size_t length = min;
    for (const Pair& pair : pairs) {
        const Path from = invert ? pair.second : pair.first;
        if (from.is_empty() || from.element_count() < length || !path.has_prefix(from)) continue;
        best = &pair;
        length = from.element_count();
    }
    return best;
}

/// Finds pairs in a list by going through it.
struct PairList {
    const Pairs& pairs;

    const Pair* best(Path path, bool invert, size_t min = 0) const {
        return best_pair(pairs, path, invert, min);
    }
};

/// The same for long lists: by the ancestors of the path. Pairs can be taken out.
class PairTable {
  public:
    explicit PairTable(const Pairs& pairs) {
        for (const Pair& pair : pairs) {
            if (!pair.first.is_empty()) by_source_[pair.first].push_back(&pair);
            if (!pair.second.is_empty()) by_target_[pair.second].push_back(&pair);
        }
    }

    const Pair* best(Path path, bool invert, size_t min = 0) const {
        const auto& table = invert ? by_target_ : by_source_;
        for (; !path.is_empty() && path.element_count() >= min; path = path.parent()) {
            const auto found = table.find(path);
            if (found != table.end() && !found->second.empty()) return found->second.back();
        }
        return nullptr;
    }

    void remove(const Pair& pair) {
        std::erase(by_source_[pair.first], &pair);
        std::erase(by_target_[pair.second], &pair);
    }

  private:
    using Table = std::unordered_map<Path, std::vector<const Pair*>>;
    Table by_source_;
    Table by_target_;
};

constexpr size_t long_list = 32;

/// True when an image is owned by a pair other than the one that made it: mapping it back would
/// lead elsewhere.
template <class Lookup>
bool is_owned_by_other(const Lookup& pairs, Path image, const Pair* made_by, bool invert) {
    const Path to = invert ? made_by->first : made_by->second;
    const Pair* owner = pairs.best(image, !invert, to.element_count());
    return owner && owner != made_by;
}

Path map_plain(const Pairs& pairs, Path path, bool invert) {
    const Pair* best = best_pair(pairs, path, invert);
    if (!best) return {};
    const Path from = invert ? best->second : best->first;
    const Path to = invert ? best->first : best->second;
    if (to.is_empty()) return {};
    const Path image = from == to ? path : path.replace_prefix(from, to, false);
    return is_owned_by_other(PairList{pairs}, image, best, invert) ? Path() : image;
}

bool comes_before(const Pair& a, const Pair& b) {
    const size_t x = a.first.element_count();
    const size_t y = b.first.element_count();
    return x != y ? x < y : a < b;
}

/// True when the map says the same without the pair.
template <class Lookup>
bool is_redundant(const Lookup& pairs, const Pair& pair) {
    const Path source = pair.first;
    const Path target = pair.second;
    if (source.is_empty() || source.is_absolute_root()) return false;
    const Pair* outer = pairs.best(source.parent(), false);
    if (target.is_empty()) {
        // A block is needed only where something would map its source
        if (!outer || outer->second.is_empty()) return true;
        const Path image = source.replace_prefix(outer->first, outer->second, false);
        return is_owned_by_other(pairs, image, outer, false);
    }
    if (!outer || outer->second.is_empty()) return false;
    if (source.replace_prefix(outer->first, outer->second, false) != target) return false;
    return !is_owned_by_other(pairs, target.parent(), outer, false);
}

}  // namespace

bool is_usable(const TimeOffset& offset) {
    return std::isfinite(offset.offset) && std::isfinite(offset.scale) && offset.scale > 0.0 &&
           std::isfinite(1.0 / offset.scale);
}

MapFunction::MapFunction(Pairs pairs, TimeOffset offset)
    : pairs_(std::move(pairs)), offset_(offset) {
    canonicalize();
}

MapFunction MapFunction::identity(TimeOffset offset) {
    const Path root = Path::absolute_root();
    return MapFunction({{root, root}}, offset);
}

void MapFunction::canonicalize() {
    if (pairs_.size() < 2) return;
    std::sort(pairs_.begin(), pairs_.end(), comes_before);
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
    if (pairs_.size() < long_list) {
        for (size_t i = 0; i < pairs_.size();) {
            if (is_redundant(PairList{pairs_}, pairs_[i])) {
                pairs_.erase(pairs_.begin() + std::ptrdiff_t(i));
            } else {
                ++i;
            }
        }
        return;
    }
    PairTable table(pairs_);
    Pairs kept;
    for (const Pair& pair : pairs_) {
        if (is_redundant(table, pair)) {
            table.remove(pair);
        } else {
            kept.push_back(pair);
        }
    }
    pairs_ = std::move(kept);
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

MapFunction MapFunction::after(const MapFunction& inner) const {
    if (is_identity()) return inner;
    if (inner.is_identity()) return *this;
    Pairs pairs;
    pairs.reserve(pairs_.size() + inner.pairs_.size());
    const Path root = Path::absolute_root();
    const Pair root_pair(root, root);
    if (has_root_identity() && inner.has_root_identity()) pairs.push_back(root_pair);
    // A source that maps nowhere stays as a block: it may hide what a shorter pair would map
    for (const Pair& pair : inner.pairs_) {
        if (pair == root_pair) continue;
        pairs.emplace_back(pair.first, map_plain(pairs_, pair.second, false));
    }
    const size_t from_inner = pairs.size();
    for (const Pair& pair : pairs_) {
        if (pair == root_pair) continue;
        const Path source = map_plain(inner.pairs_, pair.first, true);
        if (source.is_empty()) continue;
        const auto known = pairs.begin() + std::ptrdiff_t(from_inner);
        const bool is_known =
            std::any_of(pairs.begin(), known, [&](const Pair& p) { return p.first == source; });
        if (!is_known) pairs.emplace_back(source, pair.second);
    }
    return MapFunction(std::move(pairs), offset_.after(inner.offset_));
}

MapFunction MapFunction::inverse() const {
    MapFunction result;
    result.offset_ = offset_.inverse();
    result.pairs_.reserve(pairs_.size());
    for (const Pair& pair : pairs_) result.pairs_.emplace_back(pair.second, pair.first);
    std::sort(result.pairs_.begin(), result.pairs_.end(), comes_before);
    return result;
}

MapFunction MapFunction::with_root_identity() const {
    if (has_root_identity()) return *this;
    Pairs pairs = pairs_;
    const Path root = Path::absolute_root();
    pairs.emplace_back(root, root);
    return MapFunction(std::move(pairs), offset_);
}

MapFunction MapFunction::without_root_identity() const {
    MapFunction result = *this;
    std::erase_if(result.pairs_, [](const Pair& p) {
        return p.first.is_absolute_root() && p.second.is_absolute_root();
    });
    return result;
}

bool MapFunction::has_root_identity() const {
    return std::any_of(pairs_.begin(), pairs_.end(), [](const Pair& p) {
        return p.first.is_absolute_root() && p.second.is_absolute_root();
    });
}

bool MapFunction::is_identity() const {
    return pairs_.size() == 1 && has_root_identity() && offset_.is_identity();
}

size_t MapFunction::hash() const {
    uint64_t h =
        hash_combine(std::hash<double>()(offset_.offset), std::hash<double>()(offset_.scale));
    for (const Pair& pair : pairs_) {
        h = hash_combine(h, pair.first.hash());
        h = hash_combine(h, pair.second.hash());
    }
    return size_t(h);
}

MapTable::MapTable() : identity_(&*maps_.insert(MapFunction::identity()).first) {}

MapPtr MapTable::intern(MapFunction map) {
    return &*maps_.insert(std::move(map)).first;
}

MapPtr MapTable::composed(MapPtr outer, MapPtr inner) {
    if (outer == identity_) return inner;
    if (inner == identity_) return outer;
    return intern(outer->after(*inner));
}

}  // namespace velatura::usd::compose
