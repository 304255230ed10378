//! What a client may ask of the server.

use rmcp::handler::server::ServerHandler;
use rmcp::model::{
    CallToolRequestParams, CallToolResponse, GetPromptRequestParams, GetPromptResponse, Implementation,
    ListPromptsResult, ListResourceTemplatesResult, ListResourcesResult, ListToolsResult, PaginatedRequestParams,
    ReadResourceRequestParams, ReadResourceResponse, ServerCapabilities, ServerConfig, Tool,
};
use rmcp::service::RequestContext;
use rmcp::{ErrorData, RoleServer};

use super::answer::{Answer, refusal};
use super::desk::Desk;
use super::tools::{self, Offer};
use super::work::Shop;
use super::{prompts, resources};

/// What a client is told at the beginning.
const ABOUT: &str = include_str!("texts/instructions.md");

/// The server of one session.
pub struct Server {
    shop: Shop,
    offers: Vec<Offer>,
}

impl Server {
    /// Over a folder.
    pub fn new(desk: Desk) -> Self {
        Server { shop: Shop::new(desk), offers: tools::all() }
    }
}

impl ServerHandler for Server {
    fn get_info(&self) -> ServerConfig {
        let can = ServerCapabilities::builder().enable_tools().enable_resources().enable_prompts().build();
        let name = Implementation::new(env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"));
        ServerConfig::new(can).with_server_info(name).with_instructions(ABOUT.trim_end())
    }

    async fn list_tools(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        Ok(ListToolsResult::with_all_items(self.offers.iter().map(|o| o.tool.clone()).collect()))
    }

    fn get_tool(&self, name: &str) -> Option<Tool> {
        self.offers.iter().find(|o| o.tool.name == name).map(|o| o.tool.clone())
    }

    /// What is wrong with arguments or files is told as a result that the caller reads, what is no tool as an error.
    async fn call_tool(
        &self,
        call: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let Some(offer) = self.offers.iter().find(|o| o.tool.name == call.name) else {
            let names: Vec<&str> = self.offers.iter().map(|o| o.tool.name.as_ref()).collect();
            let why = format!("unknown tool `{}`; use {}", call.name, names.join(", "));
            return Err(ErrorData::invalid_params(why, None));
        };
        let answer = match (offer.order)(call.arguments.unwrap_or_default()) {
            Ok(order) => self.shop.perform(order.work, order.limit, context.ct.cancelled()).await,
            Err(why) => Err(why),
        };
        Ok(answer.map_or_else(refusal, Answer::result).into())
    }

    async fn list_resources(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListResourcesResult, ErrorData> {
        Ok(ListResourcesResult::with_all_items(resources::all()))
    }

    async fn list_resource_templates(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListResourceTemplatesResult, ErrorData> {
        Ok(ListResourceTemplatesResult::with_all_items(resources::templates()))
    }

    async fn read_resource(
        &self,
        asked: ReadResourceRequestParams,
        _: RequestContext<RoleServer>,
    ) -> Result<ReadResourceResponse, ErrorData> {
        let missing = || ErrorData::resource_not_found(format!("unknown resource `{}`", asked.uri), None);
        resources::read(&asked.uri).map(ReadResourceResponse::from).ok_or_else(missing)
    }

    async fn list_prompts(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListPromptsResult, ErrorData> {
        Ok(ListPromptsResult::with_all_items(prompts::all()))
    }

    async fn get_prompt(
        &self,
        asked: GetPromptRequestParams,
        _: RequestContext<RoleServer>,
    ) -> Result<GetPromptResponse, ErrorData> {
        let given = asked.arguments.unwrap_or_default();
        let prompt = prompts::get(&asked.name, &given).map_err(|why| ErrorData::invalid_params(why, None))?;
        Ok(prompt.into())
    }
}
