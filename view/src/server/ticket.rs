//! Tokens of addresses that open the page once.

use std::sync::{Mutex, PoisonError};

use super::token::Token;

/// A token that opens the page once: later, from a log or a history, it is useless.
pub struct Ticket {
    token: Token,
    /// The action at its first use; `None` after that.
    when_used: Mutex<Option<Box<dyn FnOnce() + Send>>>,
}

/// The result of checking a text as the token of a ticket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TicketCheck {
    Unknown,
    /// It was shown for the first time.
    Valid,
    UsedBefore,
}

impl Ticket {
    /// Makes a ticket of a token. When it is used, `when_used` is called, which must not take long.
    pub fn new(token: Token, when_used: impl FnOnce() + Send + 'static) -> Self {
        Self { token, when_used: Mutex::new(Some(Box::new(when_used))) }
    }

    /// Uses the ticket, if a text is its token.
    fn show(&self, text: &str) -> TicketCheck {
        if !self.token.is(text) {
            return TicketCheck::Unknown;
        }
        // Of two requests at once, one alone takes it.
        let unused = self.when_used.lock().unwrap_or_else(PoisonError::into_inner).take();
        match unused {
            Some(when_used) => {
                when_used();
                TicketCheck::Valid
            }
            None => TicketCheck::UsedBefore,
        }
    }
}

/// Uses the ticket that has a text as its token, if there is one.
pub(super) fn show(tickets: &[Ticket], text: &str) -> TicketCheck {
    // All tickets are compared, so that the time does not depend on which of them fits.
    let shown = tickets.iter().map(|ticket| ticket.show(text));
    shown.fold(TicketCheck::Unknown, |all, one| if one == TicketCheck::Unknown { all } else { one })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;

    #[test]
    fn each_ticket_is_used_once() {
        let used = Arc::new(AtomicU32::new(0));
        let tokens = [Token::new().unwrap(), Token::new().unwrap()];
        let texts = tokens.each_ref().map(Token::to_string);
        let tickets = tokens.map(|token| {
            let used = Arc::clone(&used);
            Ticket::new(token, move || {
                used.fetch_add(1, Ordering::Relaxed);
            })
        });
        assert_eq!(show(&tickets, "0"), TicketCheck::Unknown);
        for (before, text) in (0..).zip(&texts) {
            assert_eq!(used.load(Ordering::Relaxed), before);
            assert_eq!(show(&tickets, text), TicketCheck::Valid);
            assert_eq!(show(&tickets, text), TicketCheck::UsedBefore);
        }
        assert_eq!(used.load(Ordering::Relaxed), 2);
    }
}
