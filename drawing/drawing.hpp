// Pictures of a model in DOT, the language of Graphviz: the paper's figures 2 and 3. The same model
// gives the same text.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drawing/places.hpp"
#include "drawing/situation.hpp"
#include "rules/model/load.hpp"

namespace arbiter::drawing {

enum class View : std::uint8_t {
  kBehaviours,   // behaviours in meta-behaviours, inhibitions, conditions (figure 3)
  kConnections,  // components and their ports, connections, rules (figure 2)
  kBoth,
};

// Behaviours where the model has some; one of rules by hand has connections only.
View natural_view(const rules::LoadedModel& model);

struct Page {
  // What stands above the picture: the name of the model, and a line each for its files, what it is
  // doing where, of which port. Nothing where there is no name.
  std::string name;
  std::vector<std::string> details;
  int dpi = 0;  // dots per inch, where a picture is made of dots; 0: what Graphviz takes
};

// With a situation it is coloured by who is active and who wins. With places, connections are drawn
// in boxes of hosts, each coloured by what that host knows. The model must have no errors, but its
// rules need not be proved.
std::string draw(const rules::LoadedModel& model, View view, const Page& page = {},
                 const Situation* situation = nullptr, const Places* places = nullptr);

// What each line and sign means, in lines of text, for those who cannot see the picture's legend.
std::string legend_in_words();

}  // namespace arbiter::drawing
