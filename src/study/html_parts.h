// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/report.h"

#include <string>
#include <vector>

namespace velatura::study {

/// A cell of a table, its text escaped. name: what stands before it where the page is narrow; kind:
/// its class.
std::string cell(const char* name, const std::string& content, const char* kind = "n");

std::string header(const std::vector<const char*>& names);

/// A share as a bar with its number. color: 0 … 6, as of curves.
std::string bar(double share, int color);

/// "1.4 % [1.2 %, 1.6 %]"
std::string between(const Estimate& e);

/// An image in the page itself. What is display-referred, as StudyMap.
std::string image_tag(const std::string& name,
                      int width,
                      int height,
                      const std::vector<float>& rgb);

/// Parts of the page; empty where the report has nothing for them.
std::string images_section(const Report& report);
std::string layers_section(const Report& report);
std::string time_section(const Report& report);
std::string maps_section(const Report& report);
std::string files_section(const Report& report);

}  // namespace velatura::study
