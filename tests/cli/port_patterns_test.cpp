// What a pattern that matches nothing was probably meant to be.
#include "cli/port_patterns.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace arbiter::cli {
namespace {

TEST(SimilarPattern, NamesPartsThatExist) {
  const std::vector<std::string_view> names{"/Base/cmd:i", "/BaseLeft/cmd:i", "/gaze:i",
                                            "/Head/Gaze/pos:i"};
  const std::vector<std::pair<std::string, std::string>> cases{{"Base*", "/Base*"},
                                                               {"Base/*", "/Base/*"},
                                                               {"/Bse/*", "/Base/*"},
                                                               {"/Bsae*", "/Base*"},
                                                               {"/base*", "/Base*"},
                                                               {"/gaez*", "/gaze*"},
                                                               {"/Haed/*", "/Head/*"},
                                                               {"/Head/Gzae*", "/Head/Gaze*"},
                                                               {"Head/Gaze/*", "/Head/Gaze/*"},
                                                               {"/Gaze/po:i", ""},
                                                               {"/Arm/*", ""},
                                                               {"*x", ""},
                                                               {"/bse/cmd:i", "/Base/cmd:i"}};
  for (const auto& [typed, meant] : cases) EXPECT_EQ(similar_pattern(typed, names), meant) << typed;
}

}  // namespace
}  // namespace arbiter::cli
