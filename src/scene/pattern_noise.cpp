// SPDX-License-Identifier: Apache-2.0
#include "scene/pattern_noise.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace velatura::scene {

namespace {

/// Jenkins' lookup3 of at most four words.
uint32_t hashed(std::initializer_list<uint32_t> words) {
    const uint32_t start = 0xdeadbeefu + (uint32_t(words.size()) << 2) + 13u;
    uint32_t state[3] = {start, start, start};
    uint32_t& a = state[0];
    uint32_t& b = state[1];
    uint32_t& c = state[2];
    size_t i = 0;
    for (const uint32_t word : words) {
        if (i == 3) {
            a -= c, a ^= std::rotl(c, 4), c += b;
            b -= a, b ^= std::rotl(a, 6), a += c;
            c -= b, c ^= std::rotl(b, 8), b += a;
            a -= c, a ^= std::rotl(c, 16), c += b;
            b -= a, b ^= std::rotl(a, 19), a += c;
            c -= b, c ^= std::rotl(b, 4), b += a;
        }
        state[i++ % 3] += word;
    }
    c ^= b, c -= std::rotl(b, 14);
    a ^= c, a -= std::rotl(c, 11);
    b ^= a, b -= std::rotl(a, 25);
    c ^= b, c -= std::rotl(b, 16);
    a ^= c, a -= std::rotl(c, 4);
    b ^= a, b -= std::rotl(a, 14);
    c ^= b, c -= std::rotl(b, 24);
    return c;
}

/// Integer part of a coordinate, and what is left; coordinates beyond integers have no noise.
struct Cell {
    uint32_t index = 0;
    float rest = 0;

    explicit Cell(float x) {
        const float floor = std::floor(x);
        if (!(std::abs(floor) < 2e9f)) return;
        index = uint32_t(int32_t(floor));
        rest = x - floor;
    }
};

float fade(float t) {
    return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
}

float mixed(float a, float b, float t) {
    return (1.0f - t) * a + t * b;
}

float signed_by(float v, uint32_t bit) {
    return bit != 0 ? -v : v;
}

float gradient(uint32_t hash, float x, float y) {
    const uint32_t h = hash & 7u;
    const float u = h < 4u ? x : y;
    const float v = 2.0f * (h < 4u ? y : x);
    return signed_by(u, h & 1u) + signed_by(v, h & 2u);
}

float gradient(uint32_t hash, float x, float y, float z) {
    const uint32_t h = hash & 15u;
    const float u = h < 8u ? x : y;
    const float v = h < 4u ? y : (h == 12u || h == 14u) ? x : z;
    return signed_by(u, h & 1u) + signed_by(v, h & 2u);
}

/// Noise of `count` bytes of the hashes, each as if it were a hash.
template <int count>
void gradient_noise(const Vec2& p, float* out) {
    const Cell x(p.x), y(p.y);
    const float u = fade(x.rest), v = fade(y.rest);
    float at[2][2][count];
    for (uint32_t j = 0; j < 2; ++j) {
        for (uint32_t i = 0; i < 2; ++i) {
            const uint32_t hash = hashed({x.index + i, y.index + j});
            for (int c = 0; c < count; ++c)
                at[j][i][c] = gradient(count == 1 ? hash : hash >> (8 * c) & 0xffu,
                                       x.rest - float(i), y.rest - float(j));
        }
    }
    for (int c = 0; c < count; ++c)
        out[c] = 0.6616f *
                 mixed(mixed(at[0][0][c], at[0][1][c], u), mixed(at[1][0][c], at[1][1][c], u), v);
}

template <int count>
void gradient_noise(const Vec3& p, float* out) {
    const Cell x(p.x), y(p.y), z(p.z);
    const float u = fade(x.rest), v = fade(y.rest), w = fade(z.rest);
    float sheet[2][count];
    for (uint32_t k = 0; k < 2; ++k) {
        float at[2][2][count];
        for (uint32_t j = 0; j < 2; ++j) {
            for (uint32_t i = 0; i < 2; ++i) {
                const uint32_t hash = hashed({x.index + i, y.index + j, z.index + k});
                for (int c = 0; c < count; ++c)
                    at[j][i][c] = gradient(count == 1 ? hash : hash >> (8 * c) & 0xffu,
                                           x.rest - float(i), y.rest - float(j), z.rest - float(k));
            }
        }
        for (int c = 0; c < count; ++c)
            sheet[k][c] =
                mixed(mixed(at[0][0][c], at[0][1][c], u), mixed(at[1][0][c], at[1][1][c], u), v);
    }
    for (int c = 0; c < count; ++c) out[c] = 0.9820f * mixed(sheet[0][c], sheet[1][c], w);
}

float unit(uint32_t bits) {
    return std::min(float(bits) / 4294967296.0f, 0x1.fffffep-1f);
}

}  // namespace

float noise(const Vec2& p) {
    float out = 0;
    gradient_noise<1>(p, &out);
    return out;
}

float noise(const Vec3& p) {
    float out = 0;
    gradient_noise<1>(p, &out);
    return out;
}

Vec3 noise3(const Vec2& p) {
    Vec3 out;
    gradient_noise<3>(p, &out.x);
    return out;
}

Vec3 noise3(const Vec3& p) {
    Vec3 out;
    gradient_noise<3>(p, &out.x);
    return out;
}

float cell_noise(const Vec2& p) {
    return unit(hashed({Cell(p.x).index, Cell(p.y).index}));
}

float cell_noise(const Vec3& p) {
    return unit(hashed({Cell(p.x).index, Cell(p.y).index, Cell(p.z).index}));
}

Vec3 cell_noise3(const Vec2& p) {
    const uint32_t x = Cell(p.x).index, y = Cell(p.y).index;
    return {unit(hashed({x, y, 0u})), unit(hashed({x, y, 1u})), unit(hashed({x, y, 2u}))};
}

Vec3 cell_noise3(const Vec3& p) {
    const uint32_t x = Cell(p.x).index, y = Cell(p.y).index, z = Cell(p.z).index;
    return {unit(hashed({x, y, z, 0u})), unit(hashed({x, y, z, 1u})), unit(hashed({x, y, z, 2u}))};
}

}  // namespace velatura::scene
