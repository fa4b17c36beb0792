# The table of a `cranny compare` as Markdown: errors (eq. 31) of each view and their mean, and the
# mean time. Usage: jq -rf bench/compare_table.jq out/results.json
def row: "| " + (map(tostring) | join(" | ")) + " |";
def hundredths: (. * 100 | round) as $n | "\($n / 100 | floor).\("0\($n % 100)"[-2:])";
def milliseconds: if . < 10 then (. * 10 | round) / 10 else round end;
def mean: add / length;
def unique_in_order: reduce .[] as $x ([]; if index([$x]) then . else . + [$x] end);

[.views[] | (.scene | split("/")[-1] | split(".")[0]) + " " + .camera] as $views
| [.views[].methods[]] as $trials
| (["method"] + $views + ["mean", "ms"] | row),
  ([range($views | length + 3) | "---"] | row),
  (($trials | map([.name, .preset]) | unique_in_order[]) as $key
   | [$trials[] | select([.name, .preset] == $key)] as $all
   | [$key | join(" ")] + [$all[].error | hundredths]
     + [($all | map(.error) | mean | hundredths), ($all | map(.milliseconds) | mean | milliseconds)]
   | row)
