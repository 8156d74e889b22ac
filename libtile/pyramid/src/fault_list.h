#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

namespace nadir::pyramid {

/// What is wrong with a map, in the order of levels, rows and columns whatever finds it first. Thread-safe.
class FaultList {
 public:
  /// `level`: -1 for the file as a whole.
  void add(int level, std::int64_t row, std::int64_t col, std::string what) {
    std::scoped_lock lock(mutex_);
    ++count_;
    faults_.push_back({{level, row, col}, std::move(what)});
    if (faults_.size() < 2 * most) return;
    sort();
    faults_.resize(most);
  }
  void add(std::string what) { add(-1, 0, 0, std::move(what)); }

  std::int64_t count() const { return count_; }
  std::vector<std::string> first() {
    sort();
    std::vector<std::string> all;
    for (const Fault& fault : faults_)
      if (all.size() < most) all.push_back(fault.what);
    return all;
  }

 private:
  static constexpr std::size_t most = 1000;
  struct Fault {
    std::tuple<int, std::int64_t, std::int64_t> place;
    std::string what;
  };
  void sort() {
    std::stable_sort(faults_.begin(), faults_.end(), [](const Fault& a, const Fault& b) {
      return std::tie(a.place, a.what) < std::tie(b.place, b.what);
    });
  }
  std::mutex mutex_;
  std::int64_t count_ = 0;
  std::vector<Fault> faults_;
};

}  // namespace nadir::pyramid
