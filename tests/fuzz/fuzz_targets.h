// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

/// What fuzzers try bytes on, one function for each format. Whatever the bytes are, they are read
/// or refused; what breaks a promise of the reader aborts. Functions are called by
/// libfuzzer_entry.cpp with bytes that libFuzzer makes, and by replay_test.cpp with those of seeds/
/// and regressions/.
namespace velatura::fuzz {

void usda(std::string_view bytes);
void usdc(std::string_view bytes);
void usdz(std::string_view bytes);
void mtlx(std::string_view bytes);
void plugin(std::string_view bytes);
void preset(std::string_view bytes);
void topup(std::string_view bytes);
void layers(std::string_view bytes);
void exr(std::string_view bytes);
void lpe(std::string_view bytes);
void report(std::string_view bytes);
void tally(std::string_view bytes);
void ies(std::string_view bytes);
void gltf(std::string_view bytes);
void obj(std::string_view bytes);
void texture(std::string_view bytes);
void answer(std::string_view bytes);
void volume(std::string_view bytes);
void subdivision(std::string_view bytes);

}  // namespace velatura::fuzz
