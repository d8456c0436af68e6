// SPDX-License-Identifier: Apache-2.0
// Hostile files: whatever is done to a crate, it is read or refused. VELATURA_MUTATIONS=100000 runs
// as many.
#include "crate_fixture.h"
#include "test_assets.h"
#include "usd/crate/coding.h"
#include "usd/crate/crate_format.h"
#include "value_table.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

namespace velatura::usd::crate {
namespace {

namespace fs = std::filesystem;

using Random = std::mt19937_64;

size_t below(Random& random, size_t n) {
    return size_t(random() % n);
}

uint64_t interesting(Random& random, uint64_t size) {
    switch (below(random, 9)) {
        case 0:
            return 0;
        case 1:
            return uint64_t(-1);
        case 2:
            return 0x7fffffff;
        case 3:
            return uint64_t(1) << 63;
        case 4:
            return size - 1;
        case 5:
            return size + below(random, 16);
        case 6:
            return below(random, size);
        case 7:
            return below(random, 300);
        default:
            return random();
    }
}

/// Places where integers of the structure lie: contents, sections, the beginnings of sections.
std::vector<size_t> structure_places(const std::string& bytes) {
    std::vector<size_t> places = {8, 16};
    const uint64_t contents = get(bytes, 16);
    places.push_back(contents);
    for (uint64_t i = 0; i < 6; ++i) {
        const size_t entry = contents + 8 + i * 32;
        places.insert(places.end(), {entry, entry + 16, entry + 24});
        const uint64_t start = get(bytes, entry + 16);
        for (size_t k = 0; k < 40; k += 8) places.push_back(start + k);
    }
    return places;
}

/// Decodes the integer columns of a section, changes some and puts the section at the end.
void change_integers(std::string& bytes, Random& random) {
    struct Kind {
        size_t section;
        size_t counts;   ///< counts in front of the columns
        size_t columns;  ///< of integers
    };

    static constexpr Kind kinds[] = {{2, 1, 1}, {3, 1, 1}, {4, 2, 3}, {5, 1, 3}};
    const Kind kind = kinds[below(random, 4)];
    const size_t entry = get(bytes, 16) + 8 + kind.section * 32;
    const uint64_t start = get(bytes, entry + 16);
    if (!is_inside(bytes, start, get(bytes, entry + 24))) return;
    const uint64_t end = start + get(bytes, entry + 24);
    const uint64_t count = get(bytes, start + 8 * (kind.counts - 1));
    if (start + 8 * kind.counts > end || count == 0 || count > 100000) return;
    std::string section = bytes.substr(start, 8 * kind.counts);
    size_t at = start + 8 * kind.counts;
    const size_t chosen = below(random, kind.columns);
    for (size_t c = 0; c < kind.columns; ++c) {
        const uint64_t size = get(bytes, at);
        std::vector<int32_t> column(count);
        std::string scratch;
        const std::string_view all = bytes;
        if (!is_inside(bytes, at, 8) || !is_inside(bytes, at + 8, size) || at + 8 + size > end ||
            !decode_integers(all.substr(at + 8, size), std::span<int32_t>(column), scratch)) {
            return;
        }
        at += 8 + size;
        for (size_t k = c == chosen ? 1 + below(random, 3) : 0; k > 0; --k) {
            column[below(random, count)] = int32_t(interesting(random, count));
        }
        std::string coded;
        encode_integers(std::span<const int32_t>(column), coded);
        const uint64_t coded_size = coded.size();
        section.append(reinterpret_cast<const char*>(&coded_size), 8).append(coded);
    }
    section += bytes.substr(at, end - at);
    const uint64_t place = bytes.size();
    const uint64_t size = section.size();
    bytes += section;
    put(bytes, entry + 16, &place, 8);
    put(bytes, entry + 24, &size, 8);
}

/// Changes some values of fields.
void change_values(std::string& bytes, Random& random) {
    std::optional<ValueTable> values = ValueTable::of(bytes);
    if (!values) return;
    const size_t count = values->size();
    for (size_t k = 1 + below(random, 3); k > 0; --k) {
        const size_t chosen = below(random, count);
        const uint64_t other = (*values)[below(random, count)];
        uint64_t value = (*values)[chosen];
        switch (below(random, 4)) {
            case 0:  // another place
                value = (value & ~ValueRep::payload_mask) |
                        (interesting(random, bytes.size()) & ValueRep::payload_mask);
                break;
            case 1:  // another type
                value = (value & ~(uint64_t(0xff) << 48)) | uint64_t(below(random, 64)) << 48;
                break;
            case 2:  // other flags
                value ^= uint64_t(1) << (60 + below(random, 4));
                break;
            default:  // the place of another value
                value = (value & ~ValueRep::payload_mask) | (other & ValueRep::payload_mask);
                break;
        }
        values->set(chosen, value);
    }
    values->append_to(bytes);
}

void mutate(std::string& bytes, Random& random) {
    switch (below(random, 8)) {
        case 0:
            bytes.resize(below(random, bytes.size()));
            break;
        case 1:
            for (size_t k = 1 + below(random, 8); k > 0; --k) {
                bytes[below(random, bytes.size())] ^= char(1 << below(random, 8));
            }
            break;
        case 2: {
            const std::vector<size_t> places = structure_places(bytes);
            const uint64_t value = interesting(random, bytes.size());
            put(bytes, places[below(random, places.size())], &value, 8);
            break;
        }
        case 3: {
            // Among the values
            const size_t values = std::max<size_t>(bytes.size() / 2, bootstrap_size + 8);
            const uint64_t value = interesting(random, bytes.size());
            const size_t at = bootstrap_size + below(random, values - bootstrap_size);
            put(bytes, at, &value, below(random, 2) ? 8 : 4);
            break;
        }
        case 4: {
            const size_t from = below(random, bytes.size());
            const std::string part = bytes.substr(from, 1 + below(random, 64));
            put(bytes, below(random, bytes.size()), part.data(), part.size());
            break;
        }
        case 5:
            change_integers(bytes, random);
            break;
        default:
            change_values(bytes, random);
            break;
    }
}

std::vector<std::string> seeds() {
    std::vector<std::string> result;
    const LayerPtr all = layer_of(every_kind);
    if (all) result.push_back(crate_of(*all));
    const LayerPtr small = layer_of(
        "#usda 1.0\ndef \"A\" {\n int[] i = [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]\n"
        " float x.timeSamples = { 1: 2, 2: 3 }\n string s = \"t\"\n}\n");
    for (const uint8_t minor : {4, 5, 6, 8}) {
        if (small) result.push_back(crate_of(*small, {Version{0, minor, 0}}));
    }
    const fs::path binary = test_assets() / "aousd/file_formats/tests/assets/binary";
    if (!fs::exists(binary)) return result;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(binary)) {
        if (entry.path().extension() == ".usdc" && entry.file_size() < 20000)
            files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
        std::ifstream in(file, std::ios::binary);
        result.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return result;
}

TEST(CrateMutations, AreReadOrRefused) {
    const char* chosen = std::getenv("VELATURA_MUTATIONS");
    const size_t count = chosen ? size_t(std::strtoul(chosen, nullptr, 10)) : 3000;
    const std::vector<std::string> originals = seeds();
    size_t read = 0;
    size_t printed = 0;
    for (size_t i = 0; i < count; ++i) {
        // Each mutation by its own number, so that one can be run alone
        Random random(i);
        std::string bytes = originals[below(random, originals.size())];
        for (size_t k = 1 + below(random, 3); k > 0; --k) {
            if (bytes.size() > bootstrap_size + 16) mutate(bytes, random);
        }
        Diagnostics diagnostics;
        const auto layer = read_crate_layer(make_asset_bytes(bytes), "hostile.usdc", diagnostics);
        if (!layer) {
            EXPECT_FALSE(layer.error().message.empty());
            continue;
        }
        ++read;
        // Printing uses every array and sample; what was read is written and comes back
        const std::string text = print(**layer);
        printed += text.size();
        const auto written = write_crate_layer(**layer, diagnostics);
        ASSERT_TRUE(written) << "mutation " << i;
        const auto again = read_crate_layer(make_asset_bytes(*written), "again.usdc", diagnostics);
        ASSERT_TRUE(again) << "mutation " << i << " " << again.error().message;
        ASSERT_TRUE(print(**again) == text) << "mutation " << i;
    }
    std::printf("crate mutations: %zu, of which %zu were read (%zu bytes printed)\n", count, read,
                printed);
    EXPECT_GT(read, 0u);
    EXPECT_LT(read, count);
}

}  // namespace
}  // namespace velatura::usd::crate
