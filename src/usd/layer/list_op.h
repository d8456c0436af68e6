// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

/// A list, or edits to a weaker list. Explicit: replaces what is weaker by `explicit_items`.
/// Otherwise the edits run in the order delete, add, prepend, append, reorder. Needs std::hash<T>
/// and ==. Ref: AOUSD Core Specification 1.0.1, 6.6 (list operations).
template <class T>
struct ListOp {
    bool is_explicit = false;
    std::vector<T> explicit_items;
    std::vector<T> added;  ///< legacy: appended where not present yet
    std::vector<T> prepended;
    std::vector<T> appended;
    std::vector<T> deleted;
    std::vector<T> ordered;  ///< reorders what is present, adds nothing

    bool operator==(const ListOp&) const = default;

    static ListOp make_explicit(std::vector<T> items) {
        ListOp op;
        op.is_explicit = true;
        op.explicit_items = std::move(items);
        return op;
    }

    /// Has any opinion (an explicit empty list is one).
    bool has_opinion() const {
        return is_explicit || !added.empty() || !prepended.empty() || !appended.empty() ||
               !deleted.empty() || !ordered.empty();
    }

    /// Edits `items`, the result of everything weaker. Duplicates keep their first place.
    void apply_to(std::vector<T>& items) const;

    /// The list that comes of this op alone.
    std::vector<T> applied() const {
        std::vector<T> items;
        apply_to(items);
        return items;
    }

    /// One op that does what `weaker` and then this op do; nullopt where none can (added or ordered
    /// over a list that is not known yet).
    std::optional<ListOp> composed_over(const ListOp& weaker) const;

    /// The op with every item mapped; items for which `map` gives nullopt are dropped.
    template <class Map>
    ListOp transformed(const Map& map) const;
};

template <class T>
void unique_in_order(std::vector<T>& items) {
    std::unordered_set<T> seen;
    std::erase_if(items, [&](const T& item) { return !seen.insert(item).second; });
}

template <class T>
void erase_all(std::vector<T>& items, const std::vector<T>& unwanted) {
    if (items.empty() || unwanted.empty()) return;
    const std::unordered_set<T> set(unwanted.begin(), unwanted.end());
    std::erase_if(items, [&](const T& item) { return set.count(item) != 0; });
}

/// Moves each item of `order` that is present, with the unordered items that follow it, into that
/// order; what stands before the first ordered item stays in front.
template <class T>
void reorder_items(std::vector<T>& items, std::vector<T> order) {
    unique_in_order(order);
    const std::unordered_set<T> ordered(order.begin(), order.end());
    std::vector<std::pair<size_t, size_t>> runs;
    size_t lead = 0;
    while (lead < items.size() && ordered.count(items[lead]) == 0) ++lead;
    std::unordered_map<T, std::pair<size_t, size_t>> run_of;
    for (size_t i = lead; i < items.size();) {
        size_t end = i + 1;
        while (end < items.size() && ordered.count(items[end]) == 0) ++end;
        run_of[items[i]] = {i, end};
        i = end;
    }
    std::vector<T> result(items.begin(), items.begin() + std::ptrdiff_t(lead));
    for (const T& item : order) {
        const auto run = run_of.find(item);
        if (run == run_of.end()) continue;
        for (size_t i = run->second.first; i < run->second.second; ++i) result.push_back(items[i]);
    }
    items = std::move(result);
}

template <class T>
void ListOp<T>::apply_to(std::vector<T>& items) const {
    if (is_explicit) {
        items = explicit_items;
        unique_in_order(items);
        return;
    }
    erase_all(items, deleted);
    if (!added.empty()) {
        std::unordered_set<T> present(items.begin(), items.end());
        for (const T& item : added) {
            if (present.insert(item).second) items.push_back(item);
        }
    }
    if (!prepended.empty()) {
        erase_all(items, prepended);
        std::vector<T> front = prepended;
        unique_in_order(front);
        items.insert(items.begin(), front.begin(), front.end());
    }
    if (!appended.empty()) {
        erase_all(items, appended);
        std::vector<T> back = appended;
        unique_in_order(back);
        items.insert(items.end(), back.begin(), back.end());
    }
    if (!ordered.empty()) reorder_items(items, ordered);
}

template <class T>
std::optional<ListOp<T>> ListOp<T>::composed_over(const ListOp& weaker) const {
    if (is_explicit || !weaker.has_opinion()) return *this;
    if (!has_opinion()) return weaker;
    if (weaker.is_explicit) {
        std::vector<T> items = weaker.applied();
        apply_to(items);
        return make_explicit(std::move(items));
    }
    const auto is_legacy = [](const ListOp& op) {
        return !op.added.empty() || !op.ordered.empty();
    };
    if (is_legacy(*this) || is_legacy(weaker)) return std::nullopt;
    ListOp result = weaker;
    for (std::vector<T>* list : {&result.prepended, &result.appended, &result.deleted}) {
        erase_all(*list, deleted);
        erase_all(*list, prepended);
        erase_all(*list, appended);
    }
    result.deleted.insert(result.deleted.end(), deleted.begin(), deleted.end());
    result.prepended.insert(result.prepended.begin(), prepended.begin(), prepended.end());
    result.appended.insert(result.appended.end(), appended.begin(), appended.end());
    return result;
}

template <class T>
template <class Map>
ListOp<T> ListOp<T>::transformed(const Map& map) const {
    ListOp result;
    result.is_explicit = is_explicit;
    const auto convert = [&](const std::vector<T>& from, std::vector<T>& to) {
        for (const T& item : from) {
            if (std::optional<T> mapped = map(item)) to.push_back(*std::move(mapped));
        }
    };
    convert(explicit_items, result.explicit_items);
    convert(added, result.added);
    convert(prepended, result.prepended);
    convert(appended, result.appended);
    convert(deleted, result.deleted);
    convert(ordered, result.ordered);
    return result;
}

}  // namespace velatura::usd::layer
