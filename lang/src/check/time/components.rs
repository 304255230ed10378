//! Strongly connected components of a directed graph.
//!
//! Tarjan: Depth-first search and linear graph algorithms, SIAM J. Comput. 1 (1972) 146. Written without recursion, as plans may be long.

/// By vertex: the number of its component; none where it lies on no cycle. `next` lists the successors of each vertex.
pub(super) fn components(next: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut tarjan = Tarjan {
        index: vec![None; next.len()],
        low: vec![0; next.len()],
        on_stack: vec![false; next.len()],
        stack: Vec::new(),
        component: vec![None; next.len()],
        seen: 0,
        found: 0,
    };
    for root in 0..next.len() {
        if tarjan.index[root].is_none() {
            tarjan.search(root, next);
        }
    }
    tarjan.component
}

struct Tarjan {
    /// When each vertex was reached.
    index: Vec<Option<usize>>,
    /// The earliest vertex on the stack that it leads to.
    low: Vec<usize>,
    on_stack: Vec<bool>,
    stack: Vec<usize>,
    component: Vec<Option<usize>>,
    seen: usize,
    found: usize,
}

impl Tarjan {
    fn search(&mut self, root: usize, next: &[Vec<usize>]) {
        let mut path = vec![(root, 0)];
        self.reach(root);
        while let Some((vertex, at)) = path.last_mut() {
            let vertex = *vertex;
            let Some(&successor) = next[vertex].get(*at) else {
                path.pop();
                if let Some((outer, _)) = path.last() {
                    self.low[*outer] = self.low[*outer].min(self.low[vertex]);
                }
                self.close(vertex, next);
                continue;
            };
            *at += 1;
            match self.index[successor] {
                None => {
                    self.reach(successor);
                    path.push((successor, 0));
                }
                Some(index) if self.on_stack[successor] => self.low[vertex] = self.low[vertex].min(index),
                Some(_) => {}
            }
        }
    }

    fn reach(&mut self, vertex: usize) {
        self.index[vertex] = Some(self.seen);
        self.low[vertex] = self.seen;
        self.seen += 1;
        self.stack.push(vertex);
        self.on_stack[vertex] = true;
    }

    /// Takes the component of a vertex from the stack if it was the first of it to be reached.
    fn close(&mut self, vertex: usize, next: &[Vec<usize>]) {
        if self.index[vertex] != Some(self.low[vertex]) {
            return;
        }
        let from = self.stack.iter().rposition(|v| *v == vertex).unwrap_or_default();
        let members = self.stack.split_off(from);
        let cyclic = members.len() > 1 || next[vertex].contains(&vertex);
        for member in members {
            self.on_stack[member] = false;
            self.component[member] = cyclic.then_some(self.found);
        }
        self.found += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_on_a_cycle_share_a_component() {
        // 0 -> 1 -> 2 -> 0, 2 -> 3 -> 4 -> 3, 5 -> 0
        let next = [vec![1], vec![2], vec![0, 3], vec![4], vec![3], vec![0]];
        let found = components(&next);
        assert!(found[0].is_some() && found[0] == found[1] && found[1] == found[2]);
        assert!(found[3].is_some() && found[3] == found[4] && found[3] != found[0]);
        assert_eq!(found[5], None);
    }

    #[test]
    fn a_vertex_that_leads_to_itself_is_a_cycle() {
        assert_eq!(components(&[vec![0], vec![0]]), vec![Some(0), None]);
    }

    #[test]
    fn a_long_path_is_searched_without_recursion() {
        let next: Vec<Vec<usize>> = (0..200_000).map(|i| vec![(i + 1) % 200_000]).collect();
        assert!(components(&next).iter().all(|c| *c == Some(0)));
    }
}
