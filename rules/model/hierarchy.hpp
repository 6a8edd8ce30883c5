// Who contains whom and who inhibits whom: the names of a model, looked up.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rules/model/model.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

inline constexpr int kMaxMetaDepth = 1000;  // of meta-behaviours inside each other

// Behaviours by their index in Model::behaviours. Whatever the model says, containment is a forest
// here and inhibition is between siblings: what is against the rules was reported and left out.
class Hierarchy {
 public:
  static constexpr std::size_t kNobody = static_cast<std::size_t>(-1);

  struct Inhibitor {
    std::size_t behaviour;  // the one that inhibits
    std::size_t mention;    // in its list of inhibitions
  };

  // What of a behaviour may be meant otherwise, for something wrong was found about it.
  struct Doubt {
    bool of_rule = false;         // what is above it, or inhibits it
    bool of_inhibitions = false;  // which of its siblings it inhibits
    bool of_parts = false;        // what it contains
  };

  // What is found out, by behaviour.
  struct Relations {
    std::vector<std::size_t> parents;  // or kNobody
    std::vector<std::vector<std::size_t>> children;
    std::vector<std::vector<Inhibitor>> inhibitors;
  };

  Hierarchy(const Model& model, Diagnostics& diagnostics);

  [[nodiscard]] std::size_t parent(std::size_t behaviour) const { return parents_[behaviour]; }
  [[nodiscard]] const std::vector<std::size_t>& children(std::size_t behaviour) const {
    return children_[behaviour];
  }
  // Those that name this very behaviour, in document order.
  [[nodiscard]] const std::vector<Inhibitor>& inhibitors(std::size_t behaviour) const {
    return inhibitors_[behaviour];
  }
  [[nodiscard]] const Doubt& doubt(std::size_t behaviour) const { return doubts_[behaviour]; }
  // All of it, for those who keep it beyond the life of this.
  [[nodiscard]] Relations release() && {
    return {std::move(parents_), std::move(children_), std::move(inhibitors_)};
  }

 private:
  void index_names();
  void adopt_children();
  void cut_cycles();
  void cut_cycle(std::size_t start);
  void check_depth();
  void link_inhibitions();
  void check_emptiness() const;
  [[nodiscard]] bool may_inhibit(std::size_t inhibitor, std::size_t inhibited,
                                 const Mention& mention);
  void doubt_place(std::size_t behaviour);
  // The behaviour of that name; kNobody, reported, if there is none.
  [[nodiscard]] std::size_t look_up(const Mention& mention) const;
  [[nodiscard]] std::string longer_name(const std::string& name) const;
  [[nodiscard]] std::string advice_on_source(const std::string& name) const;
  [[nodiscard]] std::string as_list(std::string_view text) const;
  [[nodiscard]] std::string describe_place(std::size_t behaviour) const;

  const Model& model_;
  Diagnostics& diagnostics_;
  std::unordered_map<std::string, std::size_t> by_name_;
  std::vector<std::size_t> parents_;
  std::vector<const Mention*> adoptions_;  // where the parent names it
  std::vector<bool> misplaced_;            // its parent is in doubt, and that was reported
  bool lacks_parents_ = false;             // what was refused may have been the parent of anything
  std::vector<std::vector<std::size_t>> children_;
  std::vector<std::vector<Inhibitor>> inhibitors_;
  std::vector<Doubt> doubts_;
};

}  // namespace arbiter::rules
