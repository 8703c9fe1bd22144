//! Pareto fronts of two costs.

/// The points to which no other is better in one cost and as good in the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Front {
    /// Their indices, by rising first cost.
    pub members: Vec<usize>,
    /// The one farthest below the straight line that joins the ends of the front in logarithms of
    /// the costs: before it the second cost falls faster than on average, after it more slowly.
    /// `None` if none is below.
    pub knee: Option<usize>,
}

impl Front {
    /// Of points with two positive costs; others (NaN) are left out.
    pub fn of(points: &[[f64; 2]]) -> Self {
        let mut order: Vec<usize> = (0..points.len())
            .filter(|&i| points[i].iter().all(|cost| cost.is_finite() && *cost > 0.0))
            .collect();
        order.sort_by(|&a, &b| {
            points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1]))
        });
        let mut members: Vec<usize> = Vec::new();
        for i in order {
            if members.last().is_none_or(|&last| points[i][1] < points[last][1]) {
                members.push(i);
            }
        }
        let knee = knee(points, &members);
        Self { members, knee }
    }
}

fn knee(points: &[[f64; 2]], members: &[usize]) -> Option<usize> {
    let at = |&i: &usize| points[i].map(f64::ln);
    let (first, last) = (at(members.first()?), at(members.last()?));
    let below = |i: &usize| {
        let [x, y] = at(i);
        let share = (x - first[0]) / (last[0] - first[0]);
        first[1] + share * (last[1] - first[1]) - y
    };
    let (knee, depth) =
        members.iter().map(|i| (*i, below(i))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (depth > 0.0).then_some(knee)
}
