// Names of nodes in ROS 2's files of parameters, where one may stand for many: in "/*/mux" the `*`
// is any one word, in "/**/mux" the `**` any number of words, or none.
#pragma once

#include <string_view>

namespace arbiter::importing {

inline bool is_pattern(std::string_view node) { return node.find('*') != std::string_view::npos; }

// Each `*` or `**` of it is a whole word between slashes; ROS 2 allows no others.
bool is_good_pattern(std::string_view pattern);

// "/**" is for whatever node reads the file.
bool is_of_every_node(std::string_view pattern);

// Whether the pattern is for the node of this full name.
bool fits_node(std::string_view pattern, std::string_view node);

}  // namespace arbiter::importing
