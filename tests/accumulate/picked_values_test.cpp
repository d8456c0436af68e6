// SPDX-License-Identifier: Apache-2.0
#include "accumulate/picked_values.h"

#include "accumulate/layer_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace velatura::accumulate {

namespace {

PickedValue value(float depth, float a, float b) {
    PickedValue v;
    v.depth = depth;
    v.values = {a, b, 0.0f, 0.0f};
    v.is_there = true;
    return v;
}

}  // namespace

TEST(PickedValues, DoNotDependOnTheOrder) {
    std::vector<PickedValue> values = {value(3, 1, 5), value(2, 4, -0.0f), value(2, 4, 0.0f),
                                       value(2, 3, 9), value(7, -8, 2),    PickedValue{}};
    const auto comes_before = [](const PickedValue& a, const PickedValue& b) {
        return std::pair(a.depth, a.values) < std::pair(b.depth, b.values);
    };
    std::sort(values.begin(), values.end(), comes_before);
    for (const DataFilter filter : {DataFilter::Closest, DataFilter::Min, DataFilter::Max}) {
        PickedValue expected = value(2, 3, 9);
        if (filter == DataFilter::Min) expected = value(2, -8, 0);
        if (filter == DataFilter::Max) expected = value(2, 4, 9);
        do {
            PickedValue kept;
            // Twice, as in files that overlap
            for (const PickedValue& v : values) pick(filter, kept, v);
            for (const PickedValue& v : values) pick(filter, kept, v);
            ASSERT_EQ(kept, expected) << name_of(filter);
        } while (std::next_permutation(values.begin(), values.end(), comes_before));
    }
}

TEST(PickedValues, OfTwoFilmsAreThoseOfOne) {
    const image::Window window{-3, 5, 20, 40};
    const std::vector<DataFilter> filters = {DataFilter::Min, DataFilter::Closest};
    PickedValues all(window, filters), a(window, filters), b(window, filters);
    for (int i = 0; i < 200; ++i) {
        const int x = window.x0 + i * 7 % window.width(), y = window.y0 + i * 5 % window.height();
        const PickedValue v = value(float(i * 13 % 11), float(i * 17 % 7), float(i % 3));
        for (size_t layer = 0; layer < filters.size(); ++layer) {
            all.add(x, y, layer, v);
            (i % 2 == 0 ? a : b).add(x, y, layer, v);
        }
    }
    b.add(a);
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x)
            for (size_t layer = 0; layer < filters.size(); ++layer)
                ASSERT_EQ(b.at(x, y, layer), all.at(x, y, layer));
}

TEST(NamedData, SurvivesAsText) {
    LayerSet set;
    set.groups.push_back({"key", {"/key"}, false});
    DataLayer layer;
    layer.name = "Pref";
    layer.source = DataSource::Primvar;
    layer.primvar = "a:Pref";
    layer.filter = DataFilter::Max;
    layer.suffixes = "XYZ";
    layer.is_half = layer.is_premultiplied = true;
    set.named_data.push_back(layer);
    for (size_t i = 1; i < data_source_count; ++i) {
        DataLayer other;
        other.source = DataSource(i);
        other.name = name_of(other.source);
        other.suffixes = suffixes_of(other.source);
        set.named_data.push_back(other);
        EXPECT_EQ(find_data_source(other.name), other.source);
    }
    const Result<LayerSet> read = LayerSet::from_json(set.to_json());
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(*read, set);
    EXPECT_EQ(set.picking_filters(), std::vector<DataFilter>{DataFilter::Max});
}

}  // namespace velatura::accumulate
