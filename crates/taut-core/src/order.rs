//! Items put in the order of a number.
//!
//! The standard library's sort is compiled anew, at nine kilobytes, for each closure on each size
//! of surface. Here it sorts indices, and is compiled once.

/// Puts items in the order of a number, least first; items of equal numbers stay in the order that
/// they have.
pub(crate) fn sort_by_number<T>(items: &mut [T], number: impl Fn(&T) -> f64) {
    if items.len() < 2 {
        return;
    }
    let mut order = ranking(&items.iter().map(number).collect::<Vec<f64>>());
    for i in 0..order.len() {
        // The item that belongs here was swapped to where the items before it came from.
        let mut from = order[i];
        while from < i {
            from = order[from];
        }
        order[i] = from;
        items.swap(i, from);
    }
}

/// The indices of some numbers, least first; equal ones keep their order.
fn ranking(numbers: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_come_in_the_order_of_their_numbers_and_ties_stay() {
        for count in [0, 1, 2, 3, 17, 200] {
            let items: Vec<(f64, usize)> = (0..count).map(|i| ((i * 7 % 5) as f64, i)).collect();
            let (mut sorted, mut expected) = (items.clone(), items);
            sort_by_number(&mut sorted, |item| -item.0);
            expected.sort_by(|a, b| b.0.total_cmp(&a.0));
            assert_eq!(sorted, expected);
        }
    }
}
