// SPDX-License-Identifier: Apache-2.0
#include "mutant.h"

#include <algorithm>
#include <array>
#include <random>

namespace velatura::fuzz {

namespace {

/// Sizes, counts and offsets at which readers go wrong, in all widths by their low bytes.
constexpr std::array<uint64_t, 12> telling = {0,          1,          0x7f,       0x80,
                                              0xff,       0x7fff,     0xffff,     0x7fffffff,
                                              0x80000000, 0xffffffff, 0x10000001, ~uint64_t(0)};

class Mutation {
  public:
    explicit Mutation(uint64_t seed) : random_(seed) {}

    size_t below(size_t count) { return count == 0 ? 0 : size_t(random_() % count); }

    void edit(std::string& bytes, const std::string& other) {
        const size_t at = below(bytes.size() + 1), length = 1 + below(below(4) == 0 ? 256 : 8);
        switch (below(7)) {
            case 0:
                if (at < bytes.size()) bytes[at] = char(bytes[at] ^ (1 << below(8)));
                break;
            case 1:
                if (at < bytes.size()) bytes[at] = char(below(256));
                break;
            case 2:
                overwrite(bytes, at, telling[below(telling.size())], size_t(1) << below(4));
                break;
            case 3:
                bytes.erase(at, length);
                break;
            case 4:
                bytes.insert(at, bytes.substr(below(bytes.size() + 1), length));
                break;
            case 5:
                if (!other.empty()) bytes.insert(at, other, below(other.size()), length);
                break;
            default:
                if (!other.empty()) bytes.replace(at, length, other, below(other.size()), length);
                break;
        }
    }

  private:
    static void overwrite(std::string& bytes, size_t at, uint64_t value, size_t width) {
        for (size_t i = 0; i < width && at + i < bytes.size(); ++i)
            bytes[at + i] = char(value >> (8 * i));
    }

    std::mt19937_64 random_;
};

}  // namespace

std::string mutant(const std::vector<std::string>& files, uint64_t seed) {
    Mutation mutation(seed);
    std::string bytes = files[mutation.below(files.size())];
    for (size_t edits = 1 + mutation.below(6); edits > 0; --edits)
        mutation.edit(bytes, files[mutation.below(files.size())]);
    return bytes;
}

}  // namespace velatura::fuzz
