// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"

#include <string>
#include <vector>

namespace velatura::film {

/// Groups key, fill, sky (a dome), emissive and a light that never shines.
LayerSet test_layer_set();

/// Names to tell apart, hostile ones among them, and what a sample that hits something hits.
const std::vector<std::string>& test_objects();
const std::string& test_object(int x, int y, uint64_t index);

/// A made-up sample: a function of (pixel, sample index) alone, with magnitudes that show every
/// other order of additions, several deposits per cell, misses, and one bad sample at pixel (5, 3),
/// sample 6.
void fill_sample(SampleRadiance& sample, int x, int y, uint64_t index);

/// Adds samples [first, end) of all pixels; tiles in the order that `order` gives them.
void render(Film& film, uint64_t first, uint64_t end, int order = 0);

/// A path in the test's own temporary folder.
std::string temporary_file(const std::string& name);

}  // namespace velatura::film
